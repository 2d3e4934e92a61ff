//! A test rig for services without a stack: the test sets their standing and the time.
#![allow(
    clippy::missing_panics_doc,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::context::News;
use super::life::{Life, Rank};
use super::order::SendOrder;
use super::{Context, Controller, Handled, Outbox, Service, Standing, State, StopCause};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::wire::{Broadcast, Priority};

/// The client that is in control from the start.
pub const CLIENT: JausId = JausId::new(42, 1, 1);
/// Another client.
pub const STRANGER: JausId = JausId::new(42, 2, 1);

/// Services, and the state that a stack would hold for them.
pub struct Rig {
    /// The services, in the order in which they get messages.
    pub services: Vec<Box<dyn Service>>,
    /// The virtual time.
    pub now: Instant,
    news: News,
    /// Whether [`CLIENT`] shows life at each wake-up.
    pub client_lives: bool,
    life: Life,
    order: SendOrder,
    standing: Standing,
    out: Outbox,
}

impl Rig {
    /// Services in the state Ready, with [`CLIENT`] in control.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub fn new(services: Vec<Box<dyn Service>>) -> Self {
        let mut rig = Self {
            services,
            now: Instant::now(),
            news: News::default(),
            client_lives: true,
            life: Life::default(),
            order: SendOrder::default(),
            standing: Standing::default(),
            out: Outbox::new(JausId::new(101, 1, 1)),
        };
        rig.stand(State::Ready, Some(CLIENT));
        rig.wake();
        rig
    }

    /// Puts the component into another state, or under the control of another client.
    pub fn stand(&mut self, state: State, controller: Option<JausId>) {
        let controller = controller.map(|id| Controller { id, authority: 127 });
        let before = std::mem::replace(
            &mut self.standing,
            Standing {
                state,
                exclusive: true,
                controller,
                ..Standing::default()
            },
        );
        for service in &mut self.services {
            let mut context = Context::new(
                &mut self.out,
                &self.standing,
                &self.life,
                &mut self.order,
                &mut self.news,
            );
            if let Some(cause) = StopCause::of(&before, &self.standing) {
                service.handle_stop(&cause, &mut context);
            }
            service.handle_standing(self.now, &before, &mut context);
        }
    }

    /// Passes a message to the first service that handles it; returns whether one did.
    pub fn send<M: Message>(&mut self, source: JausId, message: &M) -> bool {
        self.send_as(None, source, message)
    }

    /// The same with the sender's sequence number.
    pub fn send_as<M: Message>(
        &mut self,
        sequence: Option<u16>,
        source: JausId,
        message: &M,
    ) -> bool {
        let received = self.received(sequence, source, message.encode().unwrap());
        self.services.iter_mut().any(|service| {
            let mut context = Context::new(
                &mut self.out,
                &self.standing,
                &self.life,
                &mut self.order,
                &mut self.news,
            );
            service.handle_message(self.now, &received, &mut context) == Handled::Yes
        })
    }

    fn received(&self, sequence: Option<u16>, source: JausId, payload: Bytes) -> Received {
        Received {
            source,
            destination: self.out.source(),
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload,
            sequence,
            path: None,
            to: self.out.source(),
            acknowledged: false,
        }
    }

    /// The answer to a query, if there is one.
    pub fn ask<R: Message>(&mut self, query: &impl Message) -> Option<R> {
        assert!(self.send(STRANGER, query), "nobody wants the query");
        self.answer()
    }

    /// The next message that was sent.
    pub fn answer<R: Message>(&mut self) -> Option<R> {
        self.out.pop().map(|sent| R::decode(&sent.payload).unwrap())
    }

    /// The code of the next message that was sent.
    pub fn answer_code(&mut self) -> Option<u16> {
        self.out
            .pop()
            .and_then(|sent| super::code_of(&sent.payload))
    }

    /// Advances the time, and wakes the services when they are due.
    pub fn run(&mut self, duration: Duration) {
        let end = self.now + duration;
        while let Some(wake) = self.poll_timeout().filter(|&wake| wake <= end) {
            self.now = self.now.max(wake);
            self.wake();
        }
        self.now = end;
        self.wake();
    }

    /// The codes of queries whose answers have changed, as reported by the services.
    pub fn changed(&mut self) -> &mut BTreeSet<u16> {
        &mut self.news.changed
    }

    /// The codes of commands that have ended, and whether successfully.
    #[must_use]
    pub fn ended(&self) -> &[(u16, bool)] {
        &self.news.ended
    }

    /// When the services must be woken next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let services = self.services.iter();
        services.filter_map(|service| service.poll_timeout()).min()
    }

    fn wake(&mut self) {
        if self.client_lives {
            self.life.watch(self.now, CLIENT, Rank::Controller);
            let sign = self.received(None, CLIENT, Bytes::new());
            self.life.hear(self.now, &sign);
        }
        for service in &mut self.services {
            let mut context = Context::new(
                &mut self.out,
                &self.standing,
                &self.life,
                &mut self.order,
                &mut self.news,
            );
            service.handle_timeout(self.now, &mut context);
        }
    }
}
