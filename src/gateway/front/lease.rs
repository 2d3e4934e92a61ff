//! Control over one RA component on behalf of JAUS clients.
//!
//! Towards the RA component there is one client, the gateway. Which JAUS client it stands for is
//! decided here, by the rules of Access Control: the first one who asks, and after that whoever has
//! a greater authority. Nobody is told that it has control before the RA component has said so.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::codes::{RELEASE_CONTROL, REQUEST_CONTROL};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::confirm_control::ResponseCode as Confirmation;
use crate::messages::core::reject_control::ResponseCode as Rejection;
use crate::messages::core::{ConfirmControl, RejectControl};
use crate::service::Controller;

/// Who controls an RA component through us.
#[derive(Debug)]
pub(super) struct Lease {
    state: State,
    patience: Duration,
    /// The most authority that we claim.
    most: u8,
    /// Whether the next rejection is about a hold of ours that a request of ours with more authority
    /// has ended: OpenJAUS rejects whom it takes control from, and then confirms.
    outranked_ourselves: bool,
    /// A release that is said again, because nothing answers it.
    farewell: Option<Farewell>,
    said: Said,
}

/// How often a release is still to be said, and when next.
#[derive(Debug, Clone, Copy)]
struct Farewell {
    left: u8,
    next: Instant,
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
    },
}

/// What is to be told, to clients and to the RA component.
#[derive(Debug, Default)]
pub(super) struct Said {
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
    /// How often a release is said again. One that got lost would leave the component to us for ever;
    /// whoever is not controlled by us any more ignores it.
    const FAREWELLS: u8 = 2;

    pub(super) fn new(patience: Duration, most: u8) -> Self {
        Self {
            state: State::Free,
            patience,
            most,
            outranked_ourselves: false,
            farewell: None,
            said: Said::default(),
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
    pub(super) fn take_said(&mut self) -> Said {
        std::mem::take(&mut self.said)
    }

    /// A client asks for control.
    pub(super) fn request(&mut self, now: Instant, id: JausId, authority: u8) {
        let client = Controller {
            id,
            authority: authority.min(self.most),
        };
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
            } if before.id == id => {
                let due = now >= asked + Self::RENEWAL || before.authority != client.authority;
                let asked = if due { now } else { asked };
                if due {
                    self.outranked_ourselves = client.authority > before.authority;
                    self.pass_on(client);
                }
                self.state = State::Held { client, asked };
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

    /// A client gives control back.
    pub(super) fn release(&mut self, now: Instant, client: JausId) {
        match self.state {
            State::Held { client: it, .. } | State::Asking { client: it, .. }
                if it.id == client =>
            {
                self.let_go(now);
                self.reject(client, Rejection::CONTROL_RELEASED);
            }
            // Whoever asks again, because the answer got lost, gets it again.
            State::Free => self.reject(client, Rejection::CONTROL_RELEASED),
            State::Held { .. } | State::Asking { .. } => {}
        }
    }

    /// A client is gone.
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
        self.outranked_ourselves = false;
        match (self.state, code) {
            (State::Asking { client, .. }, 0) => {
                self.state = State::Held { client, asked: now };
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
            (State::Free, _) => self.let_go(now),
        }
    }

    /// The RA component refuses control, or takes it back: somebody has a greater authority.
    pub(super) fn handle_reject(&mut self) {
        if std::mem::take(&mut self.outranked_ourselves) {
            return;
        }
        self.farewell = None;
        match std::mem::replace(&mut self.state, State::Free) {
            State::Asking { client, .. } => {
                self.confirm(client.id, Confirmation::INSUFFICIENT_AUTHORITY);
            }
            State::Held { client, .. } => self.reject(client.id, Rejection::CONTROL_RELEASED),
            State::Free => {}
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Some(farewell) = self.farewell.filter(|it| it.next <= now) {
            self.said.to_ra.push((RELEASE_CONTROL, Bytes::new()));
            self.say_again(now, farewell.left - 1);
        }
        let State::Asking {
            client,
            next,
            until,
        } = self.state
        else {
            return;
        };
        if now >= until {
            // Its answer may be what was lost.
            self.let_go(now);
            self.confirm(client.id, Confirmation::NOT_AVAILABLE);
        } else if now >= next {
            let next = (now + Self::RETRY).min(until);
            self.state = State::Asking {
                client,
                next,
                until,
            };
            self.pass_on(client);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let asking = match self.state {
            State::Asking { next, .. } => Some(next),
            State::Free | State::Held { .. } => None,
        };
        let farewell = self.farewell.map(|it| it.next);
        asking.into_iter().chain(farewell).min()
    }

    fn ask(&mut self, now: Instant, client: Controller) {
        let until = now + self.patience;
        self.farewell = None;
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
        self.said.to_ra.push((RELEASE_CONTROL, Bytes::new()));
        self.say_again(now, Self::FAREWELLS);
    }

    fn say_again(&mut self, now: Instant, left: u8) {
        let next = now + Self::RETRY;
        self.farewell = (left > 0).then_some(Farewell { left, next });
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

#[cfg(test)]
mod tests {
    use super::*;

    const CLIENT: JausId = JausId::new(42, 1, 1);
    const RIVAL: JausId = JausId::new(43, 1, 1);

    fn lease() -> (Lease, Instant) {
        #[expect(
            clippy::disallowed_methods,
            reason = "any moment will do as the beginning of virtual time"
        )]
        let now = Instant::now();
        (Lease::new(Duration::from_secs(1), 200), now)
    }

    /// Who was told what: the client, the code of the message, its response code.
    fn told(said: &Said) -> Vec<(JausId, u16, u8)> {
        let told = |(to, it): &(JausId, Bytes)| (*to, u16::from_le_bytes([it[0], it[1]]), it[2]);
        said.to_clients.iter().map(told).collect()
    }

    #[test]
    fn nobody_has_control_before_the_component_has_said_so() {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 127);
        let said = lease.take_said();
        assert_eq!(said.to_ra, [(REQUEST_CONTROL, Bytes::from_static(&[127]))]);
        assert!(told(&said).is_empty() && !lease.obeys(CLIENT));
        lease.handle_confirm(now, 0);
        assert_eq!(told(&lease.take_said()), [(CLIENT, 0x000F, 0)]);
        assert!(lease.obeys(CLIENT));
    }

    #[test]
    fn a_component_that_says_nothing_is_asked_again_and_then_not_available() {
        let (mut lease, start) = lease();
        lease.request(start, CLIENT, 127);
        let mut requests = 0;
        while let Some(wake) = lease.poll_timeout() {
            lease.handle_timeout(wake);
            let said = lease.take_said();
            requests += said
                .to_ra
                .iter()
                .filter(|it| it.0 == REQUEST_CONTROL)
                .count();
            if !said.to_clients.is_empty() {
                assert_eq!(told(&said), [(CLIENT, 0x000F, 1)]);
                assert_eq!(wake, start + Duration::from_secs(1));
            }
        }
        assert_eq!(requests, 4, "every 0.3 s within a second");
    }

    #[test]
    fn whoever_has_more_authority_takes_over_and_no_more_than_the_most_is_claimed() {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 100);
        lease.handle_confirm(now, 0);
        lease.request(now, RIVAL, 100);
        let said = lease.take_said();
        assert_eq!(told(&said)[1], (RIVAL, 0x000F, 2), "not enough");
        lease.request(now, RIVAL, 255);
        let said = lease.take_said();
        assert_eq!(told(&said), [(CLIENT, 0x0010, 0)]);
        assert_eq!(said.to_ra, [(REQUEST_CONTROL, Bytes::from_static(&[200]))]);
        // OpenJAUS rejects the hold that we had, and then confirms.
        lease.handle_reject();
        assert!(told(&lease.take_said()).is_empty());
        lease.handle_confirm(now, 0);
        assert!(lease.obeys(RIVAL) && !lease.obeys(CLIENT));
        lease.handle_reject();
        assert!(!lease.obeys(RIVAL), "the next one is meant");
    }

    #[test]
    fn a_client_that_raises_its_own_authority_keeps_control() {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 100);
        lease.handle_confirm(now, 0);
        lease.request(now, CLIENT, 150);
        lease.handle_reject();
        lease.handle_confirm(now, 0);
        assert!(lease.obeys(CLIENT));
    }

    #[test]
    fn control_is_given_back_when_its_client_lets_go_or_is_gone() {
        for gone in [false, true] {
            let (mut lease, now) = lease();
            lease.request(now, CLIENT, 100);
            lease.handle_confirm(now, 0);
            lease.take_said();
            if gone {
                lease.forget(now, CLIENT);
            } else {
                lease.release(now, CLIENT);
            }
            let said = lease.take_said();
            assert_eq!(said.to_ra, [(RELEASE_CONTROL, Bytes::new())]);
            assert_eq!(told(&said).len(), usize::from(!gone));
            assert!(lease.controller().is_none());
        }
    }

    #[test]
    fn a_release_is_said_thrice_unless_somebody_asks_again() {
        for asked_again in [false, true] {
            let (mut lease, now) = lease();
            lease.request(now, CLIENT, 100);
            lease.handle_confirm(now, 0);
            lease.release(now, CLIENT);
            let mut releases = 0;
            if asked_again {
                lease.request(now, RIVAL, 50);
                lease.handle_confirm(now, 0);
            }
            releases += lease
                .take_said()
                .to_ra
                .iter()
                .filter(|it| it.0 == RELEASE_CONTROL)
                .count();
            while let Some(wake) = lease.poll_timeout() {
                lease.handle_timeout(wake);
                let said = lease.take_said().to_ra;
                releases += said.iter().filter(|it| it.0 == RELEASE_CONTROL).count();
            }
            assert_eq!(releases, if asked_again { 1 } else { 3 });
            assert_eq!(lease.obeys(RIVAL), asked_again);
        }
    }

    #[test]
    fn a_client_is_told_when_the_component_takes_control_back() {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 100);
        lease.handle_confirm(now, 0);
        lease.take_said();
        lease.handle_reject();
        assert_eq!(told(&lease.take_said()), [(CLIENT, 0x0010, 0)]);
        assert!(!lease.obeys(CLIENT));
    }

    #[test]
    fn renewals_are_passed_on_now_and_then() {
        let (mut lease, start) = lease();
        lease.request(start, CLIENT, 100);
        lease.handle_confirm(start, 0);
        lease.take_said();
        let mut passed_on = 0;
        for renewal in 1..=8 {
            lease.request(start + renewal * Duration::from_millis(1250), CLIENT, 100);
            let said = lease.take_said();
            assert_eq!(told(&said), [(CLIENT, 0x000F, 0)]);
            passed_on += said.to_ra.len();
        }
        assert_eq!(passed_on, 2);
    }
}
