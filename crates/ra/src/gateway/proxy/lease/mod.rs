//! Control lease of one RA component on behalf of JAUS clients.
//!
//! The RA component sees one client, the gateway. The lease decides which JAUS client the gateway
//! acts for, by the rules of Access Control: the first requester, later one with a higher
//! authority. A client gets control only after the RA component has confirmed it. Control ends when
//! the client releases it, does not renew it in time, or is dead; the RA component is then
//! [stopped and released](release).

mod release;
#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use bytes::Bytes;

pub(super) use self::release::Halt;
use self::release::{Release, Standby};
use super::codes::REQUEST_CONTROL;
use crate::RaId;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::confirm_control::ResponseCode as Confirmation;
use jaus::messages::core::reject_control::ResponseCode as Rejection;
use jaus::messages::core::{ConfirmControl, RejectControl};
use jaus::service::Controller;

/// The terms of a lease.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    /// Timeout of the RA component's answer to a request.
    pub(super) patience: Duration,
    /// Maximum authority that the gateway claims.
    pub(super) authority: u8,
    /// Timeout of control after the last Request Control, plus a quarter as grace; none if zero.
    pub(super) timeout: Duration,
}

/// Control of an RA component through the gateway.
#[derive(Debug)]
pub(super) struct Lease {
    state: State,
    terms: Terms,
    /// Whether the next rejection concerns our own earlier control, outranked by our request with a
    /// higher authority: OpenJAUS rejects the previous controller, and then confirms.
    outranked_ourselves: bool,
    /// Whether the gateway is stopping and grants no further control.
    is_closed: bool,
    release: Release,
    said: Effects,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Free,
    /// The RA component was sent a request.
    Asking {
        client: Controller,
        next: Instant,
        until: Instant,
    },
    Held {
        client: Controller,
        /// Time of the last request to the RA component: renewals are forwarded at intervals.
        asked: Instant,
        /// Time of the client's last request.
        renewed: Instant,
    },
}

/// Messages to clients and to the RA component.
#[derive(Debug, Default)]
pub(super) struct Effects {
    pub(super) to_clients: Vec<(JausId, Bytes)>,
    pub(super) to_ra: Vec<(u16, Bytes)>,
    /// Whether a client was granted control.
    pub(super) granted: bool,
}

impl Lease {
    /// Interval of repeated requests without an answer.
    const RETRY: Duration = Duration::from_millis(300);
    /// Minimum interval of forwarded renewals.
    const RENEWAL: Duration = Duration::from_secs(5);

    /// A lease without a client. `own` is the gateway's RA id; `halt` stops the RA component, if it
    /// is a driver.
    pub(super) fn new(own: RaId, ra: RaId, halt: Option<Halt>, terms: Terms) -> Self {
        Self {
            state: State::Free,
            terms,
            outranked_ourselves: false,
            is_closed: false,
            release: Release::new(own, ra, halt),
            said: Effects::default(),
        }
    }

    /// Releases control left over from an earlier gateway with our id.
    pub(super) fn reclaim(&mut self, now: Instant) {
        self.release.reclaim(now);
        self.follow_release();
    }

    /// Whether the RA component is being reclaimed, and so not available yet.
    pub(super) const fn is_reclaiming(&self) -> bool {
        self.release.is_reclaiming()
    }

    /// Releases the RA component again, because it still considers us its controller although no
    /// client has control.
    pub(super) fn release_again(&mut self, now: Instant) {
        if self.state == State::Free && self.release.is_done() {
            self.release.begin(now, Standby::Spare);
            self.follow_release();
        }
    }

    /// The client in control.
    pub(super) const fn controller(&self) -> Option<Controller> {
        match self.state {
            State::Held { client, .. } => Some(client),
            State::Free | State::Asking { .. } => None,
        }
    }

    /// Whether this client may command.
    pub(super) fn obeys(&self, client: JausId) -> bool {
        self.controller().is_some_and(|it| it.id == client)
    }

    /// Whether the RA component may consider us its controller.
    pub(super) const fn is_engaged(&self) -> bool {
        !matches!(self.state, State::Free)
    }

    /// Takes the queued messages.
    pub(super) fn take_said(&mut self) -> Effects {
        std::mem::take(&mut self.said)
    }

    /// Handles a control request of a client.
    pub(super) fn request(&mut self, now: Instant, id: JausId, authority: u8) {
        let client = Controller {
            id,
            authority: authority.min(self.terms.authority),
        };
        if self.is_reclaiming() || self.is_closed {
            return self.confirm(id, Confirmation::NOT_AVAILABLE);
        }
        match self.state {
            State::Free => self.ask(now, client),
            State::Asking { client: before, .. } if before.id == id => {}
            State::Asking { client: before, .. } if client.authority <= before.authority => {
                self.confirm(id, Confirmation::INSUFFICIENT_AUTHORITY);
            }
            State::Asking { client: before, .. } => {
                self.confirm(before.id, Confirmation::INSUFFICIENT_AUTHORITY);
                self.ask(now, client);
            }
            State::Held {
                client: before,
                asked,
                ..
            } if before.id == id => {
                let due = now >= asked + Self::RENEWAL || before.authority != client.authority;
                let asked = if due { now } else { asked };
                if due {
                    self.outranked_ourselves = client.authority > before.authority;
                    self.pass_on(client);
                }
                self.state = State::Held {
                    client,
                    asked,
                    renewed: now,
                };
                self.confirm(id, Confirmation::CONTROL_ACCEPTED);
            }
            State::Held { client: before, .. } if client.authority <= before.authority => {
                self.confirm(id, Confirmation::INSUFFICIENT_AUTHORITY);
            }
            State::Held { client: before, .. } => {
                self.reject(before.id, Rejection::CONTROL_RELEASED);
                self.outranked_ourselves = true;
                self.ask(now, client);
            }
        }
    }

    /// Handles a release by a client.
    pub(super) fn release(&mut self, now: Instant, client: JausId) {
        match self.state {
            State::Held { client: it, .. } | State::Asking { client: it, .. }
                if it.id == client =>
            {
                self.let_go(now);
                self.reject(client, Rejection::CONTROL_RELEASED);
            }
            // A client repeats its release when the answer was lost; answer again.
            State::Free => self.reject(client, Rejection::CONTROL_RELEASED),
            State::Held { .. } | State::Asking { .. } => {}
        }
    }

    /// Removes a dead client.
    pub(super) fn forget(&mut self, now: Instant, client: JausId) {
        match self.state {
            State::Held { client: it, .. } | State::Asking { client: it, .. }
                if it.id == client =>
            {
                self.let_go(now);
            }
            State::Free | State::Held { .. } | State::Asking { .. } => {}
        }
    }

    /// Handles the RA component's answer to a request: 0 grants control.
    pub(super) fn handle_confirm(&mut self, now: Instant, code: u8) {
        if self.state == State::Free && self.release.handle_confirm(now, code) {
            return self.follow_release();
        }
        self.outranked_ourselves = false;
        match (self.state, code) {
            (State::Asking { client, .. }, 0) => {
                self.state = State::Held {
                    client,
                    asked: now,
                    renewed: now,
                };
                self.said.granted = true;
                self.confirm(client.id, Confirmation::CONTROL_ACCEPTED);
            }
            (State::Asking { client, .. }, _) => {
                self.state = State::Free;
                self.confirm(client.id, Confirmation::NOT_AVAILABLE);
            }
            (State::Held { client, .. }, 1..) => {
                self.state = State::Free;
                self.reject(client.id, Rejection::NOT_AVAILABLE);
            }
            (State::Held { .. }, 0) => {}
            // It considers us its controller.
            (State::Free, 0) => self.let_go(now),
            (State::Free, _) => {}
        }
    }

    /// Handles a report of the RA component's controller.
    pub(super) fn handle_controller(&mut self, now: Instant, controller: RaId) {
        self.release.handle_report(now, controller);
        self.follow_release();
    }

    /// Handles a rejection: the RA component refuses or revokes control, for a higher authority.
    pub(super) fn handle_reject(&mut self) {
        if std::mem::take(&mut self.outranked_ourselves) {
            return;
        }
        self.release.handle_reject();
        match std::mem::replace(&mut self.state, State::Free) {
            State::Asking { client, .. } => {
                self.confirm(client.id, Confirmation::INSUFFICIENT_AUTHORITY);
            }
            State::Held { client, .. } => self.reject(client.id, Rejection::CONTROL_RELEASED),
            State::Free => {}
        }
    }

    /// Ends expired control and requests. Call it before queued messages are handled.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        self.release.handle_timeout(now);
        self.follow_release();
        match self.state {
            State::Free => {}
            State::Asking { client, until, .. } if now >= until => {
                // Its answer may have been lost.
                self.let_go(now);
                self.confirm(client.id, Confirmation::NOT_AVAILABLE);
            }
            State::Asking {
                client,
                next,
                until,
            } if now >= next => {
                self.state = State::Asking {
                    client,
                    next: (now + Self::RETRY).min(until),
                    until,
                };
                self.pass_on(client);
            }
            State::Held {
                client, renewed, ..
            } if self.ends(renewed).is_some_and(|end| end <= now) => {
                tracing::info!(client = %client.id, "control not renewed in time: released");
                self.let_go(now);
                self.reject(client.id, Rejection::CONTROL_RELEASED);
            }
            State::Asking { .. } | State::Held { .. } => {}
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let own = match self.state {
            State::Free => None,
            State::Asking { next, .. } => Some(next),
            State::Held { renewed, .. } => self.ends(renewed),
        };
        own.into_iter().chain(self.release.poll_timeout()).min()
    }

    /// Expiry of control that was last renewed at `renewed`.
    fn ends(&self, renewed: Instant) -> Option<Instant> {
        let timeout = self.terms.timeout;
        (!timeout.is_zero()).then(|| renewed + timeout + timeout / 4)
    }

    fn ask(&mut self, now: Instant, client: Controller) {
        let until = now + self.terms.patience;
        // Until the release is known to have arrived, we are still in control, and the component
        // rejects us before it confirms.
        self.outranked_ourselves |= !self.release.is_done();
        self.release.cancel();
        self.state = State::Asking {
            client,
            next: (now + Self::RETRY).min(until),
            until,
        };
        self.pass_on(client);
    }

    fn pass_on(&mut self, client: Controller) {
        let body = Bytes::copy_from_slice(&[client.authority]);
        self.said.to_ra.push((REQUEST_CONTROL, body));
    }

    fn let_go(&mut self, now: Instant) {
        self.state = State::Free;
        self.outranked_ourselves = false;
        self.release.begin(now, Standby::Send);
        self.follow_release();
    }

    /// Whether the RA component is released, as far as known.
    pub(super) fn is_released(&self) -> bool {
        !self.is_engaged() && self.release.is_done()
    }

    /// Ends the lease because the gateway stops or the RA component is gone. The round is sent
    /// twice, as there may be no time to repeat it.
    pub(super) fn end(&mut self, now: Instant) {
        self.is_closed = true;
        let controller = self.controller();
        if !self.is_released() {
            self.let_go(now);
            self.release.round(Standby::Send);
            self.follow_release();
        }
        if let Some(client) = controller {
            self.reject(client.id, Rejection::CONTROL_RELEASED);
        }
    }

    fn follow_release(&mut self) {
        self.said.to_ra.extend(self.release.take_commands());
    }

    fn confirm(&mut self, client: JausId, response_code: Confirmation) {
        self.tell(client, &ConfirmControl { response_code });
    }

    fn reject(&mut self, client: JausId, response_code: Rejection) {
        self.tell(client, &RejectControl { response_code });
    }

    fn tell<M: Message>(&mut self, client: JausId, message: &M) {
        match message.encode() {
            Ok(payload) => self.said.to_clients.push((client, payload)),
            Err(error) => tracing::error!(%client, %error, "cannot send the message"),
        }
    }
}
