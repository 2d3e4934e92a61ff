//! Control of one RA component on behalf of JAUS clients.
//!
//! Towards the RA component there is one client, the gateway. The lease decides which JAUS client it
//! stands for, by the rules of Access Control: the first client that asks, and after that one with a
//! greater authority. A client gets control only after the RA component has confirmed it. Control ends
//! when the client releases it, does not renew it in time, or is dead; the RA component is then
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
    /// How long the RA component may take to answer a request.
    pub(super) patience: Duration,
    /// The most authority that the gateway claims.
    pub(super) authority: u8,
    /// Control ends this long after the last Request Control, with a quarter's grace; never, if zero.
    pub(super) timeout: Duration,
}

/// Control of an RA component through the gateway.
#[derive(Debug)]
pub(super) struct Lease {
    state: State,
    terms: Terms,
    /// Whether the next rejection is about a hold of ours that a request of ours with more authority
    /// has ended: OpenJAUS rejects whom it takes control from, and then confirms.
    outranked_ourselves: bool,
    /// Whether the gateway stops, and gives control to no client any more.
    is_closed: bool,
    release: Release,
    said: Effects,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Free,
    /// The RA component has been asked.
    Asking {
        client: Controller,
        next: Instant,
        until: Instant,
    },
    Held {
        client: Controller,
        /// When the RA component was asked last: renewals are passed on now and then.
        asked: Instant,
        /// When the client asked last.
        renewed: Instant,
    },
}

/// What is to be told, to clients and to the RA component.
#[derive(Debug, Default)]
pub(super) struct Effects {
    pub(super) to_clients: Vec<(JausId, Bytes)>,
    pub(super) to_ra: Vec<(u16, Bytes)>,
    /// Whether a client has been given control.
    pub(super) granted: bool,
}

impl Lease {
    /// Requests that are not answered are repeated after this time.
    const RETRY: Duration = Duration::from_millis(300);
    /// Renewals of clients are passed on as seldom as this.
    const RENEWAL: Duration = Duration::from_secs(5);

    /// A lease that no client holds. `own` is the gateway among RA systems; `halt` stops the RA
    /// component, if it is a driver.
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

    /// Releases what an earlier gateway with our id has left held.
    pub(super) fn reclaim(&mut self, now: Instant) {
        self.release.reclaim(now);
        self.follow_release();
    }

    /// Whether the RA component is being reclaimed: it is not available until that is done.
    pub(super) const fn is_reclaiming(&self) -> bool {
        self.release.is_reclaiming()
    }

    /// Releases the RA component again, because it still takes us for its controller though no client
    /// has control.
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

    /// Whether the RA component may think that we control it.
    pub(super) const fn is_engaged(&self) -> bool {
        !matches!(self.state, State::Free)
    }

    /// What is to be told since this was asked last.
    pub(super) fn take_said(&mut self) -> Effects {
        std::mem::take(&mut self.said)
    }

    /// A client asks for control.
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

    /// A client releases control.
    pub(super) fn release(&mut self, now: Instant, client: JausId) {
        match self.state {
            State::Held { client: it, .. } | State::Asking { client: it, .. }
                if it.id == client =>
            {
                self.let_go(now);
                self.reject(client, Rejection::CONTROL_RELEASED);
            }
            // A client that asks again, because the answer was lost, gets it again.
            State::Free => self.reject(client, Rejection::CONTROL_RELEASED),
            State::Held { .. } | State::Asking { .. } => {}
        }
    }

    /// A client is dead.
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

    /// The RA component has answered a request: 0 is yes.
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
            // It thinks that we control it.
            (State::Free, 0) => self.let_go(now),
            (State::Free, _) => {}
        }
    }

    /// The RA component has reported who controls it.
    pub(super) fn handle_controller(&mut self, now: Instant, controller: RaId) {
        self.release.handle_report(now, controller);
        self.follow_release();
    }

    /// The RA component refuses control, or takes it back: somebody has a greater authority.
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

    /// Ends what has lasted too long. To be called before messages that have waited are handled.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        self.release.handle_timeout(now);
        self.follow_release();
        match self.state {
            State::Free => {}
            State::Asking { client, until, .. } if now >= until => {
                // Its answer may be what was lost.
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

    /// When control ends that was renewed then.
    fn ends(&self, renewed: Instant) -> Option<Instant> {
        let timeout = self.terms.timeout;
        (!timeout.is_zero()).then(|| renewed + timeout + timeout / 4)
    }

    fn ask(&mut self, now: Instant, client: Controller) {
        let until = now + self.terms.patience;
        // A release that is not known to have arrived leaves us in control, and the component then
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

    /// Whether the RA component has been released, as far as is known.
    pub(super) fn is_released(&self) -> bool {
        !self.is_engaged() && self.release.is_done()
    }

    /// Ends the lease because the gateway stops or the RA component is gone. The round is sent twice,
    /// for there may be no time to repeat it.
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
            Err(error) => tracing::error!(%client, %error, "message cannot be sent"),
        }
    }
}
