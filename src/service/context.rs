//! What a service is given beside a message or the time: who may command, where its answers go,
//! and how it says that something has changed or is done.

use std::collections::BTreeSet;
use std::time::Instant;

use bytes::Bytes;

use super::life::Life;
use super::{Outbox, Standing, StopCause};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;

/// What services have said for whoever wants to know.
#[derive(Debug, Default)]
pub(crate) struct News {
    /// The codes of queries whose answers are others now.
    pub(crate) changed: BTreeSet<u16>,
    /// The codes of commands that have come to an end, and whether to the wanted one.
    pub(crate) ended: Vec<(u16, bool)>,
    /// What services have found broken, and how many have recovered, in this order.
    pub(crate) faults: Vec<Result<(), StopCause>>,
}

/// One service's view of its component while it handles something.
#[derive(Debug)]
pub struct Context<'a> {
    out: &'a mut Outbox,
    standing: &'a Standing,
    life: &'a Life,
    news: &'a mut News,
}

impl<'a> Context<'a> {
    pub(super) const fn new(
        out: &'a mut Outbox,
        standing: &'a Standing,
        life: &'a Life,
        news: &'a mut News,
    ) -> Self {
        Self {
            out,
            standing,
            life,
            news,
        }
    }

    /// The component that the service belongs to.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.out.source()
    }

    /// The state of the component, and who controls it.
    #[must_use]
    pub const fn standing(&self) -> &Standing {
        self.standing
    }

    /// When a client showed its last sign of life, if it is in control, or if a service
    /// [depends](super::Service::depends_on) on it.
    #[must_use]
    pub fn last_sign(&self, client: JausId) -> Option<Instant> {
        self.life.last_sign(client)
    }

    /// Reports that something is broken: a component with Management goes to
    /// [`State::Failure`](super::State::Failure), which ends control, until each
    /// service that has failed has [recovered](Self::recover) as often.
    pub fn fail(&mut self, cause: StopCause) {
        self.news.faults.push(Err(cause));
    }

    /// Reports that what led to one [`fail`](Self::fail) is no more. The component goes to standby when
    /// nothing is broken any more.
    pub fn recover(&mut self) {
        self.news.faults.push(Ok(()));
    }

    /// Sends a message to one component.
    pub fn send<M: Message>(&mut self, destination: JausId, message: &M) {
        self.out.send(destination, message);
    }

    /// Sends octets that begin with a message code to one component.
    pub fn send_octets(&mut self, destination: JausId, payload: Bytes) {
        self.out.send_octets(destination, payload);
    }

    /// Answers a message: to its sender alone, however many it went to, with its priority.
    pub fn reply<M: Message>(&mut self, to: &Received, message: &M) {
        self.out.reply(to, message);
    }

    /// The same, until the receiver has acknowledged it: for answers of many datagrams, of which one
    /// that is lost would cost all.
    pub fn reply_until_acknowledged<M: Message>(&mut self, to: &Received, message: &M) {
        self.out.reply_until_acknowledged(to, message);
    }

    /// Says that the answer to the query `Q` is another now: whoever subscribed to it hears of it.
    pub fn changed<Q: Message>(&mut self) {
        self.news.changed.insert(Q::CODE);
    }

    /// Says that the command with this code which was last carried out has come to its end, and
    /// whether that is the wanted one: whoever asked for a command event hears of it. Only commands
    /// whose end a service [tells](super::Service::tells_end_of) can be asked for so.
    pub fn ended(&mut self, command: u16, successful: bool) {
        self.news.ended.push((command, successful));
    }
}
