//! Sessions: control of any one member of an audience, kept through the faults of a field day.
//!
//! A session looks for a member in the directory, takes control of it, makes it ready, and watches
//! it. If the peer restarts, falls silent or leaves, the session starts over, with another member if
//! necessary. It does not override a deliberate act: after another client has taken control,
//! [`Retake`] decides; after an emergency, the peer stays in standby until the application resumes
//! it.

mod examination;
mod held;
mod settings;
mod state;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use self::examination::Examination;
use self::held::Held;
pub use self::settings::{Retake, SessionOrder, SessionSettings, TargetState};
pub use self::state::{SessionLoss, SessionState};
use super::control::ControlId;
use super::news::{ControlLost, ControlNews, ControlRefused};
use super::{Controls, Introduction};
use crate::address::JausId;
use crate::endpoint::Received;
use crate::messages::core::management;
use crate::service::{Audience, Directory, Incarnation, Outbox, Patience, State};

/// Identifies one session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(u64);

/// What a session needs of its component.
pub(in crate::service) struct Surroundings<'a> {
    pub(in crate::service) directory: Arc<Directory>,
    pub(in crate::service) own: Incarnation,
    pub(in crate::service) controls: &'a mut Controls,
    pub(in crate::service) out: &'a mut Outbox,
}

/// The sessions of one component.
#[derive(Debug, Default)]
pub(in crate::service) struct Sessions {
    last: u64,
    all: BTreeMap<SessionId, Session>,
    /// The directory that the sessions know.
    seen: Option<Arc<Directory>>,
    news: VecDeque<(SessionId, SessionState)>,
}

#[derive(Debug)]
struct Session {
    audience: Audience,
    settings: SessionSettings,
    patience: Patience,
    stage: Stage,
    /// The last loss, until the peer is under control again or the application asks for that.
    loss: Option<(JausId, SessionLoss)>,
    /// Whether it had control since the application last asked for that.
    was_held: bool,
    /// The pause after the next loss.
    pause: Duration,
    /// The state that the application knows.
    reported: SessionState,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Until the directory has a member of the audience.
    Seeking,
    /// Until the peer has answered or the examination has timed out.
    Examining(Examination),
    Asking(JausId, ControlId),
    Held(Held),
    /// Until the next attempt.
    Pausing(Instant),
    /// Until the application asks for control again.
    Ended,
    /// Until the peer confirms, or the release times out.
    Releasing(ControlId),
    Released,
}

impl Sessions {
    pub(in crate::service) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Begins a session.
    pub(in crate::service) fn begin(
        &mut self,
        now: Instant,
        audience: Audience,
        settings: SessionSettings,
        patience: Patience,
        around: &mut Surroundings<'_>,
    ) -> SessionId {
        self.last += 1;
        let id = SessionId(self.last);
        let session = Session {
            audience,
            settings,
            patience,
            stage: Stage::Pausing(now),
            loss: None,
            was_held: false,
            pause: Session::FIRST_PAUSE,
            reported: SessionState::Seeking,
        };
        self.all.insert(id, session);
        self.proceed(now, around);
        id
    }

    /// Carries out an order of the application.
    pub(in crate::service) fn order(
        &mut self,
        now: Instant,
        id: SessionId,
        order: SessionOrder,
        around: &mut Surroundings<'_>,
    ) {
        if let Some(session) = self.all.get_mut(&id) {
            session.obey(now, order);
        }
        self.proceed(now, around);
    }

    /// Ends a session and releases its peer.
    pub(in crate::service) fn release(
        &mut self,
        now: Instant,
        id: SessionId,
        around: &mut Surroundings<'_>,
    ) {
        if let Some(session) = self.all.get_mut(&id) {
            session.stage = session.control().map_or(Stage::Released, |control| {
                around.controls.release(now, control, around.out);
                Stage::Releasing(control)
            });
        }
        self.proceed(now, around);
    }

    /// Handles a message that may answer an examination. Others may need it, too.
    pub(in crate::service) fn handle_message(&mut self, message: &Received) {
        for session in self.all.values_mut() {
            if let Stage::Examining(examination) = &mut session.stage {
                examination.handle_message(message);
            }
        }
    }

    /// Handles news of control; false if it belongs to no session.
    pub(in crate::service) fn handle_control(
        &mut self,
        now: Instant,
        control: ControlId,
        news: ControlNews,
        around: &mut Surroundings<'_>,
    ) -> bool {
        let mut sessions = self.all.values_mut();
        let Some(session) = sessions.find(|it| it.control() == Some(control)) else {
            return false;
        };
        session.handle_control(now, news, around);
        self.proceed(now, around);
        true
    }

    /// Handles the time and changes of the directory.
    pub(in crate::service) fn proceed(&mut self, now: Instant, around: &mut Surroundings<'_>) {
        let known = &around.directory;
        let is_new = !self
            .seen
            .as_ref()
            .is_some_and(|seen| Arc::ptr_eq(seen, known));
        self.seen = (!self.all.is_empty()).then(|| known.clone());
        let news = &mut self.news;
        self.all.retain(|&id, session| {
            session.proceed(now, is_new, around);
            let state = session.state();
            if std::mem::replace(&mut session.reported, state) != state {
                news.push_back((id, state));
            }
            state != SessionState::Released
        });
    }

    pub(in crate::service) fn poll_timeout(&self) -> Option<Instant> {
        self.all.values().filter_map(Session::poll_timeout).min()
    }

    pub(in crate::service) fn poll_news(&mut self) -> Option<(SessionId, SessionState)> {
        self.news.pop_front()
    }
}

impl Session {
    /// The pause after a loss doubles from this …
    const FIRST_PAUSE: Duration = Duration::from_millis(250);
    /// … to this, and starts again once the peer was under control for as long.
    const LONGEST_PAUSE: Duration = Duration::from_secs(2);

    const fn control(&self) -> Option<ControlId> {
        match self.stage {
            Stage::Asking(_, control) | Stage::Releasing(control) => Some(control),
            Stage::Held(Held { control, .. }) => Some(control),
            _ => None,
        }
    }

    const fn peer(&self) -> Option<JausId> {
        match self.stage {
            Stage::Asking(peer, _) | Stage::Held(Held { peer, .. }) => Some(peer),
            _ => None,
        }
    }

    fn state(&self) -> SessionState {
        match (self.stage, self.loss) {
            (Stage::Released, _) => SessionState::Released,
            (Stage::Releasing(_), _) => self.reported,
            (Stage::Held(held), _) => held.state(self.settings.target),
            (stage, Some((peer, why))) => SessionState::Lost {
                peer,
                why,
                continues: !matches!(stage, Stage::Ended),
            },
            (Stage::Asking(peer, _), None) => SessionState::Requesting(peer),
            (Stage::Examining(it), None) => SessionState::Requesting(it.peer),
            (Stage::Seeking | Stage::Pausing(_) | Stage::Ended, None) => SessionState::Seeking,
        }
    }

    /// Whether an emergency is the last that the peer has reported.
    fn is_in_emergency(&self) -> bool {
        match self.stage {
            Stage::Held(held) => held.is_in_emergency(),
            _ => self
                .loss
                .is_some_and(|(_, why)| why == SessionLoss::State(State::Emergency as u8)),
        }
    }

    fn obey(&mut self, now: Instant, order: SessionOrder) {
        if matches!(order, SessionOrder::Target(TargetState::Ready)) && self.is_in_emergency() {
            return;
        }
        match (order, &mut self.stage) {
            (SessionOrder::Target(target), stage) => {
                self.settings.target = target;
                if let Stage::Held(held) = stage {
                    held.due = now;
                }
            }
            (SessionOrder::Retake, Stage::Ended | Stage::Pausing(_) | Stage::Examining(_)) => {
                self.stage = Stage::Pausing(now);
                self.loss = None;
                self.was_held = false;
            }
            (SessionOrder::Retake, _) => {}
        }
    }

    /// Nothing moves again by itself: from now on the application decides when the peer is ready.
    const fn stand_by(&mut self) {
        if matches!(self.settings.target, TargetState::Ready) {
            self.settings.target = TargetState::Standby;
        }
    }

    fn handle_control(&mut self, now: Instant, news: ControlNews, around: &mut Surroundings<'_>) {
        match (&mut self.stage, news) {
            (Stage::Releasing(_), ControlNews::Refused(_) | ControlNews::Released) => {
                self.stage = Stage::Released;
            }
            (&mut Stage::Asking(peer, control), ControlNews::Granted) => {
                self.loss = None;
                self.was_held = true;
                self.stage = Stage::Held(Held {
                    peer,
                    control,
                    since: now,
                    is_managed: is_managed(peer, &around.directory),
                    status: None,
                    due: now,
                });
            }
            (&mut Stage::Asking(peer, _), ControlNews::Refused(why)) => {
                self.explain(now, peer, SessionLoss::Refused(why), around);
            }
            (Stage::Held(held), ControlNews::Status(status)) => {
                held.status = Some(status);
                if held.is_in_emergency() {
                    self.stand_by();
                }
            }
            (&mut Stage::Held(held), ControlNews::Lost(why)) => {
                around.controls.release(now, held.control, around.out);
                self.explain(now, held.peer, SessionLoss::Control(why), around);
            }
            _ => {}
        }
    }

    /// Asks the peer for the precise reason of a loss, if it can be expected to answer.
    fn explain(&mut self, now: Instant, peer: JausId, why: SessionLoss, around: &Surroundings<'_>) {
        if let Stage::Held(held) = self.stage
            && now.saturating_duration_since(held.since) >= Self::LONGEST_PAUSE
        {
            self.pause = Self::FIRST_PAUSE;
        }
        match why {
            SessionLoss::Refused(
                ControlRefused::NotAvailable | ControlRefused::InsufficientAuthority(_),
            )
            | SessionLoss::Control(
                ControlLost::TakenBack
                | ControlLost::NotAvailable
                | ControlLost::Outranked
                | ControlLost::Restarted,
            ) => self.examine(now, peer, Some(why), around),
            _ => self.lose(now, peer, why),
        }
    }

    fn examine(
        &mut self,
        now: Instant,
        peer: JausId,
        why: Option<SessionLoss>,
        around: &Surroundings<'_>,
    ) {
        let is_managed = is_managed(peer, &around.directory);
        self.stage = Stage::Examining(Examination::new(now, peer, is_managed, why));
    }

    fn lose(&mut self, now: Instant, peer: JausId, why: SessionLoss) {
        let is_first_come = why.is_opposition() && !self.was_held;
        if !why.is_technical() && !is_first_come {
            self.stand_by();
        }
        self.loss = Some((peer, why));
        let continues = match self.settings.retake {
            Retake::Never => false,
            Retake::Unopposed => !why.is_opposition(),
            Retake::WhenFree | Retake::Always => true,
        };
        self.stage = match continues {
            true => Stage::Pausing(now + self.pause),
            false => Stage::Ended,
        };
        self.pause = (self.pause * 2).min(Self::LONGEST_PAUSE);
    }

    fn proceed(&mut self, now: Instant, has_news: bool, around: &mut Surroundings<'_>) {
        if let (true, Some(peer), Some(control)) = (has_news, self.peer(), self.control())
            && !self.members(around).contains(&peer)
        {
            around.controls.release(now, control, around.out);
            self.explain(now, peer, SessionLoss::Gone, around);
        }
        match self.stage {
            Stage::Pausing(until) if until <= now => self.seek(now, around),
            Stage::Seeking if has_news => self.seek(now, around),
            _ => {}
        }
        if let Stage::Examining(examination) = &mut self.stage
            && examination.proceed(now, around.out)
        {
            let examination = *examination;
            let (peer, result) = (examination.peer, examination.result(around.out.source()));
            match (result, self.settings.retake) {
                (Some(SessionLoss::Taken(_)), Retake::Always) if examination.why.is_none() => {
                    self.stand_by();
                    self.ask(now, peer, around);
                }
                (Some(why), _) => self.lose(now, peer, why),
                (None, _) => self.ask(now, peer, around),
            }
        }
        if let Stage::Held(held) = &mut self.stage {
            if has_news {
                held.is_managed = is_managed(held.peer, &around.directory);
            }
            held.manage(now, self.settings.target, around.out);
        }
    }

    /// Turns to a member of the audience, the lost one before others.
    fn seek(&mut self, now: Instant, around: &mut Surroundings<'_>) {
        self.stage = Stage::Seeking;
        let members = self.members(around);
        let lost = self.loss.map(|(peer, _)| peer);
        let same = lost.filter(|peer| members.contains(peer));
        let Some(peer) = same.or_else(|| members.first().copied()) else {
            return;
        };
        match self.loss {
            None => self.ask(now, peer, around),
            // Another client may have taken control meanwhile.
            Some(_) => self.examine(now, peer, None, around),
        }
    }

    fn ask(&mut self, now: Instant, peer: JausId, around: &mut Surroundings<'_>) {
        let (authority, patience) = (self.settings.authority, self.patience);
        let Surroundings { controls, out, .. } = around;
        let introduction = Introduction::new(around.own, &around.directory, peer);
        match controls.request(now, peer, authority, patience, introduction, out) {
            Ok(control) => self.stage = Stage::Asking(peer, control),
            Err(why) => self.lose(now, peer, SessionLoss::Refused(why)),
        }
    }

    /// The known members of the audience. A single component need not be known.
    fn members(&self, around: &Surroundings<'_>) -> Vec<JausId> {
        match self.audience.as_destination() {
            Some(id) if id.is_unicast() => vec![id],
            _ => self
                .audience
                .members(&around.directory, around.out.source()),
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self.stage {
            Stage::Pausing(until) => Some(until),
            Stage::Examining(examination) => Some(examination.poll_timeout()),
            Stage::Held(held) => held.poll_timeout(self.settings.target),
            _ => None,
        }
    }
}

/// Whether a component has states, as far as known.
fn is_managed(peer: JausId, directory: &Directory) -> bool {
    let known = directory.component(peer);
    known.is_none_or(|it| it.services.is_none() || it.offers(management::URN))
}
