//! Sessions: control of any one member of an audience, kept through the faults of a field day.
//!
//! A session looks for a member in the directory, takes control of it, makes it ready, and watches
//! it. If the peer restarts, falls silent or leaves, the session starts over, with another member if
//! necessary. It does not override a deliberate act: after another client has taken control,
//! [`Retake`] decides; after an emergency, the peer stays in standby until the application resumes
//! it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Controls;
use super::control::{ControlId, ControlLost, ControlNews, ControlRefused};
use crate::address::JausId;
use crate::messages::core::{Resume, Standby, management};
use crate::service::{Audience, Directory, Outbox, Patience, State};
use crate::wire::Priority;

/// Identifies one session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(u64);

/// When a session takes control again after losing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Retake {
    /// Only when the application asks for it.
    Never,
    /// After restarts, silence and emergencies, but not after another client took control or was
    /// found to have it: it may have had a reason. Then only when the application asks for it.
    #[default]
    Unopposed,
    /// Whenever the peer grants it. Two such clients with equal authorities share a vehicle in
    /// turns.
    Always,
}

/// The progress of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionState {
    /// It looks for a member of its audience, asks it for control, or brings it into the wanted
    /// state.
    Engaging,
    /// This peer obeys commands.
    Ready(JausId),
    /// This peer is under control and stands by, because the application wants that or has to
    /// decide anew after an emergency or a loss.
    Standby(JausId),
    /// There is no use of the peer at present.
    Lost {
        /// The peer.
        peer: JausId,
        /// The reason.
        why: SessionLoss,
        /// Whether the session goes on by itself. Otherwise the application must ask for that.
        continues: bool,
    },
    /// The session was released.
    Released,
}

/// Why a session has no use of its peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionLoss {
    /// Control was not granted.
    #[error("control was not granted: {0}")]
    Refused(ControlRefused),
    /// Control was lost.
    #[error("control was lost: {0}")]
    Control(ControlLost),
    /// The peer reports a state in which it can neither stand by nor act, by its code in Report
    /// Status.
    #[error("it reports {}", in_words(*.0))]
    State(u8),
    /// The peer left the directory, or no longer offers the service.
    #[error("it left the network, or no longer offers the service")]
    Gone,
}

impl SessionLoss {
    /// Whether nobody caused it on purpose.
    const fn is_technical(self) -> bool {
        match self {
            Self::Control(why) => matches!(why, ControlLost::Restarted | ControlLost::Silent(_)),
            Self::Refused(why) => {
                matches!(why, ControlRefused::NoAnswer(_) | ControlRefused::Already)
            }
            Self::Gone => true,
            Self::State(_) => false,
        }
    }

    /// Whether another client has control.
    const fn is_opposition(self) -> bool {
        match self {
            Self::Control(why) => matches!(why, ControlLost::TakenBack | ControlLost::Outranked),
            Self::Refused(why) => matches!(why, ControlRefused::InsufficientAuthority(_)),
            Self::Gone | Self::State(_) => false,
        }
    }
}

fn in_words(code: u8) -> String {
    let known = State::from_code(code).map(|state| state.to_string());
    known.unwrap_or_else(|| format!("the unknown state {code}"))
}

/// What the application wants of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionOrder {
    /// Make the peer ready, now and after restarts.
    Resume,
    /// Keep the peer in standby.
    Standby,
    /// Take control again.
    Retake,
}

/// What a session needs of its component.
pub(in crate::service) struct Surroundings<'a> {
    pub(in crate::service) directory: Arc<Directory>,
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
    authority: u8,
    retake: Retake,
    patience: Patience,
    /// Whether the peer is to be ready.
    wants_ready: bool,
    stage: Stage,
    /// The last loss, until the peer is under control again or the application asks for that.
    loss: Option<(JausId, SessionLoss)>,
    /// The pause after the next loss.
    pause: Duration,
    /// The state that the application knows.
    reported: SessionState,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Until the directory has a member of the audience.
    Seeking,
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

/// A peer under control.
#[derive(Debug, Clone, Copy)]
struct Held {
    peer: JausId,
    control: ControlId,
    since: Instant,
    /// Whether it has states. Otherwise it obeys commands as soon as it is under control, and only
    /// the session can stand by.
    is_managed: bool,
    status: Option<u8>,
    /// When to send Resume or Standby, if the status is not as wanted.
    due: Instant,
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
        authority: u8,
        retake: Retake,
        patience: Patience,
        around: &mut Surroundings<'_>,
    ) -> SessionId {
        self.last += 1;
        let id = SessionId(self.last);
        let session = Session {
            audience,
            authority,
            retake,
            patience,
            wants_ready: true,
            stage: Stage::Pausing(now),
            loss: None,
            pause: Session::FIRST_PAUSE,
            reported: SessionState::Engaging,
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
    /// Interval of Resume and Standby until the peer reports that state. A large machine takes a
    /// moment to change it.
    const REPEAT: Duration = Duration::from_millis(500);

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
            (Stage::Held(held), _) => held.state(self.wants_ready),
            (_, None) => SessionState::Engaging,
            (stage, Some((peer, why))) => SessionState::Lost {
                peer,
                why,
                continues: !matches!(stage, Stage::Ended),
            },
        }
    }

    fn obey(&mut self, now: Instant, order: SessionOrder) {
        match order {
            SessionOrder::Resume => self.wants_ready = true,
            SessionOrder::Standby => self.wants_ready = false,
            SessionOrder::Retake => {
                if matches!(self.stage, Stage::Ended | Stage::Pausing(_)) {
                    self.stage = Stage::Pausing(now);
                    self.loss = None;
                }
            }
        }
        if let Stage::Held(held) = &mut self.stage {
            held.due = now;
        }
    }

    fn handle_control(&mut self, now: Instant, news: ControlNews, around: &mut Surroundings<'_>) {
        match (&mut self.stage, news) {
            (Stage::Releasing(_), ControlNews::Refused(_) | ControlNews::Released) => {
                self.stage = Stage::Released;
            }
            (&mut Stage::Asking(peer, control), ControlNews::Granted) => {
                self.loss = None;
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
                self.lose(now, peer, SessionLoss::Refused(why));
            }
            (Stage::Held(held), ControlNews::Status(status)) => {
                held.status = Some(status);
                self.wants_ready &= status != State::Emergency as u8;
            }
            (&mut Stage::Held(held), ControlNews::Lost(why)) => {
                around.controls.release(now, held.control, around.out);
                self.lose(now, held.peer, SessionLoss::Control(why));
            }
            _ => {}
        }
    }

    fn lose(&mut self, now: Instant, peer: JausId, why: SessionLoss) {
        if let Stage::Held(held) = self.stage
            && now.saturating_duration_since(held.since) >= Self::LONGEST_PAUSE
        {
            self.pause = Self::FIRST_PAUSE;
        }
        self.wants_ready &= why.is_technical();
        self.loss = Some((peer, why));
        let continues = match self.retake {
            Retake::Never => false,
            Retake::Unopposed => !why.is_opposition(),
            Retake::Always => true,
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
            self.lose(now, peer, SessionLoss::Gone);
        }
        match self.stage {
            Stage::Pausing(until) if until <= now => self.seek(now, around),
            Stage::Seeking if has_news => self.seek(now, around),
            _ => {}
        }
        if let Stage::Held(held) = &mut self.stage {
            if has_news {
                held.is_managed = is_managed(held.peer, &around.directory);
            }
            held.manage(now, self.wants_ready, around.out);
        }
    }

    /// Asks a member of the audience for control, the lost one before others.
    fn seek(&mut self, now: Instant, around: &mut Surroundings<'_>) {
        self.stage = Stage::Seeking;
        let members = self.members(around);
        let lost = self.loss.map(|(peer, _)| peer);
        let same = lost.filter(|peer| members.contains(peer));
        let Some(peer) = same.or_else(|| members.first().copied()) else {
            return;
        };
        let Surroundings { controls, out, .. } = around;
        match controls.request(now, peer, self.authority, self.patience, out) {
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
            Stage::Held(held) => held.order(self.wants_ready).map(|_| held.due),
            _ => None,
        }
    }
}

impl Held {
    fn state(&self, wants_ready: bool) -> SessionState {
        let peer = self.peer;
        if !self.is_managed {
            return match wants_ready {
                true => SessionState::Ready(peer),
                false => SessionState::Standby(peer),
            };
        }
        let Some(code) = self.status else {
            return SessionState::Engaging;
        };
        match (State::from_code(code), wants_ready) {
            (Some(State::Ready), true) => SessionState::Ready(peer),
            (Some(State::Standby), false) => SessionState::Standby(peer),
            (Some(State::Initialize | State::Ready | State::Standby), _) => SessionState::Engaging,
            _ => SessionState::Lost {
                peer,
                why: SessionLoss::State(code),
                continues: true,
            },
        }
    }

    /// The state command that the peer needs.
    fn order(&self, wants_ready: bool) -> Option<SessionOrder> {
        if !self.is_managed {
            return None;
        }
        match (self.status.map(State::from_code), wants_ready) {
            (None | Some(Some(State::Initialize | State::Standby)), true) => {
                Some(SessionOrder::Resume)
            }
            (Some(Some(State::Ready)), false) => Some(SessionOrder::Standby),
            _ => None,
        }
    }

    fn manage(&mut self, now: Instant, wants_ready: bool, out: &mut Outbox) {
        if self.due > now {
            return;
        }
        match self.order(wants_ready) {
            Some(SessionOrder::Resume) => out.send_with(self.peer, Priority::High, &Resume {}),
            Some(_) => out.send_with(self.peer, Priority::High, &Standby {}),
            None => return,
        }
        self.due = now + Session::REPEAT;
    }
}

/// Whether a component has states, as far as known.
fn is_managed(peer: JausId, directory: &Directory) -> bool {
    let known = directory.component(peer);
    known.is_none_or(|it| it.services.is_none() || it.offers(management::URN))
}
