//! Control over other components: requests, renewals, detection of loss, and release.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use super::Introduction;
use super::news::{ControlLost, ControlNews, ControlRefused};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{
    ConfirmControl, QueryControl, QueryStatus, QueryTimeout, RejectControl, ReleaseControl,
    ReportControl, ReportStatus, ReportTimeout, RequestControl,
};
use crate::service::restart_watch::{RestartWatch, Sameness};
use crate::service::{Handled, NoAnswer, Outbox, Patience, code_of, read};

/// Identifies one request for control of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ControlId(u64);

/// The control that one component has or requests.
#[derive(Debug, Default)]
pub(in crate::service) struct Controls {
    last: u64,
    /// By peer, because Confirm Control does not identify the request that it confirms.
    all: BTreeMap<JausId, Control>,
    news: VecDeque<(ControlId, ControlNews)>,
}

#[derive(Debug)]
struct Control {
    id: ControlId,
    authority: u8,
    patience: Patience,
    state: State,
    /// What the first requests are preceded by, so that the peer tells this client from an earlier
    /// incarnation.
    introduction: Introduction,
    /// Whether the peer is still the same.
    watch: RestartWatch,
    /// How long control lasts, once the peer has reported it. Zero means for ever.
    lifetime: Option<Duration>,
    /// How often the peer was asked for its lifetime.
    lifetime_asked: u32,
    /// Requests since the last answer, and when the first of them was sent.
    asked: u32,
    first_asked: Instant,
    /// Whether the peer has refused to renew it.
    denied: bool,
    /// The earliest time at which the peer may have started to count the lifetime.
    confirmed: Instant,
    next: Instant,
    /// When it was last released, by this request or the previous one.
    released: Option<Instant>,
    status: Status,
}

/// What is known of the peer's status.
#[derive(Debug, Default)]
struct Status {
    reported: Option<u8>,
    /// Queries since the last report.
    asked: u32,
    next: Option<Instant>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Asking,
    Held,
    /// Lost, but not yet released by the application.
    Lost(ControlLost),
    /// Being released since this time.
    Releasing(Instant),
    /// The same after a request without an answer: the peer may have granted control all the same. The
    /// application knows that the request is over.
    GivenUp(Instant),
    /// The application knows that it has ended. The entry stays for as long as the peer may still
    /// answer a release.
    Over,
}

impl Controls {
    pub(in crate::service) fn request(
        &mut self,
        now: Instant,
        peer: JausId,
        authority: u8,
        patience: Patience,
        introduction: Introduction,
        out: &mut Outbox,
    ) -> Result<ControlId, ControlRefused> {
        if !peer.is_unicast() {
            return Err(ControlRefused::NotOneComponent);
        }
        let active = |it: &Control| matches!(it.state, State::Asking | State::Held);
        if self.all.get(&peer).is_some_and(active) {
            return Err(ControlRefused::Already);
        }
        self.last += 1;
        let id = ControlId(self.last);
        let mut control = Control {
            id,
            authority,
            patience,
            state: State::Asking,
            introduction,
            watch: RestartWatch::default(),
            lifetime: None,
            lifetime_asked: 0,
            asked: 0,
            first_asked: now,
            denied: false,
            confirmed: now,
            next: now,
            released: None,
            status: Status::default(),
        };
        if let Some(before) = self.all.remove(&peer) {
            control.released = before.released;
            if !matches!(before.state, State::Over | State::GivenUp(_)) {
                self.news.push_back((before.id, ControlNews::Released));
            }
        }
        control.ask(now, peer, out);
        self.all.insert(peer, control);
        Ok(id)
    }

    /// Releases control, or cancels the request.
    pub(in crate::service) fn release(&mut self, now: Instant, id: ControlId, out: &mut Outbox) {
        let found = self.all.iter_mut().find(|(_, it)| it.id == id);
        let Some((&peer, control)) = found else {
            return;
        };
        match control.state {
            State::Lost(ControlLost::TakenBack | ControlLost::Outranked) => {
                control.state = State::Over;
                self.news.push_back((id, ControlNews::Released));
            }
            State::Releasing(_) | State::GivenUp(_) | State::Over => {}
            // Otherwise the peer may keep its side of the control until it receives a release.
            State::Asking | State::Held | State::Lost(_) => {
                control.state = State::Releasing(now);
                control.send_release(now, peer, out);
            }
        }
    }

    /// Whether a release still waits for its peer's confirmation.
    pub(in crate::service) fn is_releasing(&self) -> bool {
        let mut all = self.all.values();
        all.any(|it| matches!(it.state, State::Releasing(_)))
    }

    /// Releases everything.
    pub(in crate::service) fn release_all(&mut self, now: Instant, out: &mut Outbox) {
        let held: Vec<_> = self.all.values().map(|it| it.id).collect();
        for id in held {
            self.release(now, id, out);
        }
    }

    pub(in crate::service) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Handled {
        let peer = message.source;
        let Some(control) = self.all.get_mut(&peer) else {
            return Handled::No;
        };
        let code = code_of(&message.payload);
        if control.state == State::Over && code != Some(ConfirmControl::CODE) {
            return Handled::No;
        }
        let id = control.id;
        let news = match code {
            Some(ConfirmControl::CODE) => read::<ConfirmControl>(message)
                .and_then(|it| control.handle_confirm(now, peer, it.response_code.0, out)),
            Some(RejectControl::CODE) => read::<RejectControl>(message)
                .and_then(|it| control.handle_reject(now, peer, it.response_code.0, out)),
            Some(ReportControl::CODE) => read::<ReportControl>(message).and_then(|it| {
                let controller = JausId::new(it.subsystem_id, it.node_id, it.component_id);
                control.handle_report(now, peer, controller == out.source(), out)
            }),
            Some(ReportStatus::CODE) => read::<ReportStatus>(message)
                .and_then(|it| control.handle_status(peer, it.status.0, out)),
            Some(ReportTimeout::CODE) => {
                if let Some(report) = read::<ReportTimeout>(message) {
                    control.handle_lifetime(now, report.timeout.0);
                }
                None
            }
            _ => return Handled::No,
        };
        if news.is_some_and(ControlNews::is_final) {
            control.state = State::Over;
        }
        self.news.extend(news.map(|news| (id, news)));
        Handled::Yes
    }

    /// Notes a message of a peer. One that has restarted knows nothing of the control that this
    /// client had.
    pub(in crate::service) fn watch_for_restart(&mut self, now: Instant, message: &Received) {
        let Some(control) = self.all.get_mut(&message.source) else {
            return;
        };
        match (control.watch.note(now, message), control.state) {
            // Its numbers alone do not tell: it is asked who its controller is.
            (Sameness::Restarted, State::Held) if control.watch.incarnation().is_none() => {
                control.next = now;
            }
            (Sameness::Restarted, State::Held) => {
                let news = control.lose(ControlLost::Restarted);
                self.news.extend(news.map(|news| (control.id, news)));
            }
            // Its next answer decides, so it is asked at once.
            (Sameness::Doubtful, State::Held) => {
                control.status.next = control.status.next.map(|_| now);
            }
            _ => {}
        }
    }

    pub(in crate::service) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        let news = &mut self.news;
        self.all.retain(|&peer, control| {
            let change = control.handle_timeout(now, peer, out);
            news.extend(change.map(|change| (control.id, change)));
            if change.is_some_and(ControlNews::is_final)
                && !matches!(control.state, State::GivenUp(_))
            {
                control.state = State::Over;
            }
            control.state != State::Over || control.awaits_answer_to_release(now)
        });
    }

    pub(in crate::service) fn poll_timeout(&self) -> Option<Instant> {
        self.all.values().filter_map(Control::poll_timeout).min()
    }

    pub(in crate::service) fn poll_news(&mut self) -> Option<(ControlId, ControlNews)> {
        self.news.pop_front()
    }
}

impl Control {
    /// The longest interval between renewals. JAUS++ renews every 1.25 s.
    const RENEWAL: Duration = Duration::from_secs(1);
    /// Interval of status queries. Short enough to serve as a sign of life for a peer that stops
    /// when its client has been silent for a second.
    const STATUS: Duration = Duration::from_millis(200);
    /// A peer without Management does not report its status. After this many unanswered queries
    /// they become as rare as renewals; they do not stop, for the reports may have been lost.
    const STATUS_TRIES: u32 = 10;
    /// An unconfirmed renewal is repeated after this time, so that a few lost confirmations in a
    /// row do not cost control.
    const RETRY: Duration = Duration::from_millis(250);
    /// Interval of renewals while the lifetime of control is unknown.
    const HASTE: Duration = Duration::from_millis(200);
    /// How often the peer is asked for the lifetime of control.
    const LIFETIME_TRIES: u32 = 4;
    /// Control that is not confirmed for this time is lost, whatever its lifetime. It is also the
    /// lifetime if the peer does not report one. It is JAUS++'s timeout.
    const LIFETIME: Duration = Duration::from_secs(5);
    /// An unconfirmed release is repeated for this time; by then control has timed out. An answer
    /// may arrive for the same time after the last release.
    const RELEASE_LIMIT: Duration = Duration::from_secs(5);

    /// How long a confirmation is valid.
    fn lifetime(&self) -> Duration {
        match self.lifetime {
            Some(lifetime) if !lifetime.is_zero() => lifetime.min(Self::LIFETIME),
            _ => Self::LIFETIME,
        }
    }

    /// The interval between renewals. Several may be lost before control is.
    fn renewal(&self) -> Duration {
        let most = match self.awaits_lifetime() {
            true => Self::HASTE,
            false => Self::RENEWAL,
        };
        (self.lifetime() / 4).min(most)
    }

    /// Whether the lifetime of control is still being queried.
    const fn awaits_lifetime(&self) -> bool {
        self.lifetime.is_none() && self.lifetime_asked < Self::LIFETIME_TRIES
    }

    fn ask(&mut self, now: Instant, peer: JausId, out: &mut Outbox) {
        // First the introduction, if there is one: before it the peer may take what comes for a sign
        // that its old client has restarted, and reject that.
        self.request(now, peer, out);
        if self.awaits_lifetime() {
            self.lifetime_asked += 1;
            out.send(peer, &QueryTimeout {});
        }
    }

    fn renew(&mut self, now: Instant, peer: JausId, out: &mut Outbox) {
        // Sent before the request: the answer shows whether the peer still knows its client. A
        // restarted peer does not.
        out.send(peer, &QueryControl {});
        self.ask(now, peer, out);
    }

    fn request(&mut self, now: Instant, peer: JausId, out: &mut Outbox) {
        let authority_code = self.authority;
        // Sent before the request: what an earlier incarnation of this client held ends first.
        if self.watch.incarnation().is_none()
            && let Some(query) = self.introduction.take()
        {
            out.send(peer, &query);
        }
        out.send(peer, &RequestControl { authority_code });
        if self.asked == 0 {
            self.first_asked = now;
        }
        self.asked = self.asked.saturating_add(1);
        self.next = now
            + match self.state {
                State::Held => self.renewal().min(Self::RETRY),
                _ => self.patience.interval,
            };
    }

    fn send_release(&mut self, now: Instant, peer: JausId, out: &mut Outbox) {
        out.send(peer, &ReleaseControl {});
        self.released = Some(now);
        self.next = now + self.patience.interval;
    }

    /// Whether the peer may still answer a release. That answer does not end control requested
    /// after the release: the network may deliver the request first.
    fn awaits_answer_to_release(&self, now: Instant) -> bool {
        self.released
            .is_some_and(|released| now < released + Self::RELEASE_LIMIT)
    }

    fn handle_confirm(
        &mut self,
        now: Instant,
        peer: JausId,
        code: u8,
        out: &mut Outbox,
    ) -> Option<ControlNews> {
        match (self.state, code) {
            (State::Asking | State::Held, 0) => {
                // The confirmation does not say which request it answers. It may be the first, and
                // the others lost. Over a long way the repetitions are confirmed as well, later: those
                // confirm nothing new.
                if self.asked > 0 {
                    self.confirmed = self.first_asked;
                    self.next = now + self.renewal();
                }
                self.asked = 0;
                self.denied = false;
                let granted = self.state == State::Asking;
                self.state = State::Held;
                self.status.next.get_or_insert(now);
                granted.then_some(ControlNews::Granted)
            }
            (State::Asking, code) => Some(ControlNews::Refused(match code {
                1 => ControlRefused::NotAvailable,
                2 => ControlRefused::InsufficientAuthority(self.authority),
                code => ControlRefused::Code(code),
            })),
            (State::Held, 2) => self.lose(ControlLost::Outranked),
            // For instance an emergency: control is not renewed, but may still be kept.
            (State::Held, _) => {
                self.denied = true;
                self.asked = 0;
                out.send(peer, &QueryControl {});
                None
            }
            // A request that was in flight when control was lost or given up has obtained it without
            // the application's knowledge.
            (State::Lost(_) | State::GivenUp(_) | State::Over, 0) => {
                self.send_release(now, peer, out);
                None
            }
            _ => None,
        }
    }

    /// Handles a report of the peer's status. A peer that has changed it may have restarted: who is
    /// its client then?
    fn handle_status(&mut self, peer: JausId, status: u8, out: &mut Outbox) -> Option<ControlNews> {
        self.status.asked = 0;
        let before = self.status.reported.replace(status);
        if self.state != State::Held || before == Some(status) {
            return None;
        }
        if before.is_some() {
            out.send(peer, &QueryControl {});
        }
        Some(ControlNews::Status(status))
    }

    /// Handles a report of the peer's controller. Control whose renewal was denied continues if its
    /// lifetime is unlimited, and ends with its lifetime otherwise.
    fn handle_report(
        &mut self,
        now: Instant,
        peer: JausId,
        is_ours: bool,
        out: &mut Outbox,
    ) -> Option<ControlNews> {
        if self.state != State::Held {
            return None;
        }
        if !is_ours {
            return match self.denied {
                true => self.lose(ControlLost::NotAvailable),
                false => self.lose_or_ask_again(now, peer, ControlLost::Restarted, out),
            };
        }
        if self.denied && self.lifetime == Some(Duration::ZERO) {
            self.confirmed = now;
        }
        None
    }

    fn handle_reject(
        &mut self,
        now: Instant,
        peer: JausId,
        code: u8,
        out: &mut Outbox,
    ) -> Option<ControlNews> {
        match (self.state, code) {
            (State::Held, 0) => {
                let news = self.lose_or_ask_again(now, peer, ControlLost::TakenBack, out);
                if news.is_some() {
                    // Perhaps it ends an earlier control, and has come after the confirmation of this
                    // one: then the peer would keep a client that believes to have lost it.
                    out.send(peer, &ReleaseControl {});
                }
                news
            }
            (State::Held, _) => self.lose(ControlLost::NotAvailable),
            (State::Releasing(_), _) => Some(ControlNews::Released),
            (State::GivenUp(_), _) => {
                self.state = State::Over;
                None
            }
            // The end of an earlier control.
            (State::Asking | State::Lost(_) | State::Over, _) => None,
        }
    }

    /// Handles a report that this client no longer controls the peer. If a release may have arrived
    /// after the granted request, that release ended it, and control is requested again. If another
    /// client has control by now, it keeps it, and the answer says so.
    fn lose_or_ask_again(
        &mut self,
        now: Instant,
        peer: JausId,
        why: ControlLost,
        out: &mut Outbox,
    ) -> Option<ControlNews> {
        if !self.awaits_answer_to_release(now) {
            return self.lose(why);
        }
        self.request(now, peer, out);
        None
    }

    fn lose(&mut self, why: ControlLost) -> Option<ControlNews> {
        self.state = State::Lost(why);
        Some(ControlNews::Lost(why))
    }

    fn handle_lifetime(&mut self, now: Instant, seconds: u8) {
        self.lifetime = Some(Duration::from_secs(seconds.into()));
        if self.state == State::Held {
            self.next = self.next.min(now + self.renewal());
        }
    }

    fn handle_timeout(
        &mut self,
        now: Instant,
        peer: JausId,
        out: &mut Outbox,
    ) -> Option<ControlNews> {
        if self.poll_timeout().is_none_or(|due| due > now) {
            return None;
        }
        self.ask_status(now, peer, out);
        let exhausted = self.asked >= self.patience.tries.max(1);
        match self.state {
            State::Asking if exhausted => {
                let no_answer = NoAnswer {
                    peer,
                    tries: self.asked,
                    waited: now.saturating_duration_since(self.first_asked),
                };
                // Perhaps only the answers were lost, and the peer has granted control.
                self.state = State::GivenUp(now);
                self.send_release(now, peer, out);
                Some(ControlNews::Refused(ControlRefused::NoAnswer(no_answer)))
            }
            State::Held if now >= self.confirmed + self.lifetime() => {
                let since = now.saturating_duration_since(self.confirmed);
                self.lose(match self.denied {
                    true => ControlLost::NotAvailable,
                    false => ControlLost::Silent(since),
                })
            }
            State::Held if self.next > now => None,
            State::Asking => {
                self.ask(now, peer, out);
                None
            }
            State::Held => {
                self.renew(now, peer, out);
                None
            }
            State::Releasing(since) if now >= since + Self::RELEASE_LIMIT => {
                Some(ControlNews::Released)
            }
            State::GivenUp(since) if now >= since + Self::RELEASE_LIMIT => {
                self.state = State::Over;
                None
            }
            State::Releasing(_) | State::GivenUp(_) => {
                self.send_release(now, peer, out);
                None
            }
            State::Lost(_) | State::Over => None,
        }
    }

    /// Queries the status of a peer under control if a query is due.
    fn ask_status(&mut self, now: Instant, peer: JausId, out: &mut Outbox) {
        if self.state != State::Held || self.status.next.is_none_or(|next| next > now) {
            return;
        }
        let is_silent = self.status.reported.is_none() && self.status.asked >= Self::STATUS_TRIES;
        let pause = match is_silent {
            true => Self::RENEWAL,
            false => Self::STATUS,
        };
        self.status.next = Some(now + pause);
        self.status.asked = self.status.asked.saturating_add(1);
        out.send(peer, &QueryStatus {});
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self.state {
            State::Asking | State::Releasing(_) | State::GivenUp(_) => Some(self.next),
            State::Held => {
                let end = self.confirmed + self.lifetime();
                [Some(self.next), Some(end), self.status.next]
                    .into_iter()
                    .flatten()
                    .min()
            }
            State::Lost(_) => None,
            State::Over => {
                let answered = |released| released + Self::RELEASE_LIMIT;
                Some(self.released.map_or(self.first_asked, answered))
            }
        }
    }
}
