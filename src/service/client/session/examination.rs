//! The questions to a peer that is not, or no longer, under control: which state it is in, and which
//! client controls it.

use std::time::{Duration, Instant};

use super::super::news::ControlLost;
use super::SessionLoss;
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{QueryControl, QueryStatus, ReportControl, ReportStatus};
use crate::service::{Outbox, State, code_of, read};

/// An examination of a peer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Examination {
    pub(super) peer: JausId,
    /// The loss to explain. Otherwise the session is about to ask for control.
    pub(super) why: Option<SessionLoss>,
    /// Whether it has states.
    is_managed: bool,
    tries: u32,
    next: Instant,
    status: Option<u8>,
    controller: Option<JausId>,
}

impl Examination {
    /// How long an answer may take …
    const PATIENCE: Duration = Duration::from_millis(250);
    /// … and how often the queries are sent.
    const TRIES: u32 = 2;

    pub(super) const fn new(
        now: Instant,
        peer: JausId,
        is_managed: bool,
        why: Option<SessionLoss>,
    ) -> Self {
        Self {
            peer,
            why,
            is_managed,
            tries: 0,
            next: now,
            status: None,
            controller: None,
        }
    }

    pub(super) fn handle_message(&mut self, message: &Received) {
        if message.source != self.peer {
            return;
        }
        match code_of(&message.payload) {
            Some(ReportStatus::CODE) => {
                self.status = read::<ReportStatus>(message).map(|it| it.status.0);
            }
            Some(ReportControl::CODE) => {
                self.controller = read::<ReportControl>(message)
                    .map(|it| JausId::new(it.subsystem_id, it.node_id, it.component_id));
            }
            _ => {}
        }
    }

    /// Sends the queries that are due. Returns whether the examination is over: answered, or timed
    /// out.
    pub(super) fn proceed(&mut self, now: Instant, out: &mut Outbox) -> bool {
        let is_answered = self.controller.is_some() && (self.status.is_some() || !self.is_managed);
        if is_answered || (now >= self.next && self.tries >= Self::TRIES) {
            return true;
        }
        if now >= self.next {
            self.tries += 1;
            self.next = now + Self::PATIENCE;
            out.send(self.peer, &QueryControl {});
            if self.is_managed {
                out.send(self.peer, &QueryStatus {});
            }
        }
        false
    }

    pub(super) const fn poll_timeout(&self) -> Instant {
        self.next
    }

    /// The reason why the client `own` cannot have control, as precisely as it is known. `None` if
    /// it may ask for control.
    pub(super) fn result(&self, own: JausId) -> Option<SessionLoss> {
        let disabled = [State::Emergency, State::Failure, State::Shutdown];
        if let Some(code) = self.status
            && disabled.iter().any(|state| *state as u8 == code)
        {
            return Some(SessionLoss::State(code));
        }
        match (self.controller, self.why) {
            (Some(id), _) if id.is_unicast() && id != own => Some(SessionLoss::Taken(id)),
            (Some(_), Some(SessionLoss::Control(ControlLost::TakenBack))) => {
                Some(SessionLoss::Dropped)
            }
            (_, why) => why,
        }
    }
}
