//! The context of a service call: who may command, where replies go, and how a service reports
//! changes and finished commands.

use std::collections::BTreeSet;
use std::time::{Instant, SystemTime};

use bytes::Bytes;

use super::life::Life;
use super::order::SendOrder;
use super::{Controller, Outbox, Publication, Standing, StopCause, Validity};
use crate::address::JausId;
use crate::codec::{Message, Query, Report};
use crate::endpoint::Received;

/// What services have reported since the stack last looked.
#[derive(Debug, Default)]
pub(crate) struct News {
    /// The codes of queries whose answers have changed.
    pub(crate) changed: BTreeSet<u16>,
    /// Published reports, on their way to the services that answer with them.
    pub(crate) published: Vec<Publication>,
    /// The codes of commands that have ended, and whether successfully.
    pub(crate) ended: Vec<(u16, bool)>,
    /// Faults (`Err`) and recoveries (`Ok`), in the order of their reports.
    pub(crate) faults: Vec<Result<(), StopCause>>,
    /// A client whose setpoints may be too old to move anything.
    pub(crate) late: Option<JausId>,
    /// The client that is to have control.
    pub(crate) handover: Option<Controller>,
}

/// A service's view of its component during one call.
#[derive(Debug)]
pub struct Context<'a> {
    out: &'a mut Outbox,
    standing: &'a Standing,
    life: &'a Life,
    order: &'a mut SendOrder,
    news: &'a mut News,
}

impl<'a> Context<'a> {
    pub(super) const fn new(
        out: &'a mut Outbox,
        standing: &'a Standing,
        life: &'a Life,
        order: &'a mut SendOrder,
        news: &'a mut News,
    ) -> Self {
        Self {
            out,
            standing,
            life,
            order,
            news,
        }
    }

    /// The same context, for a shorter time.
    pub(super) const fn reborrow(&mut self) -> Context<'_> {
        Context {
            out: self.out,
            standing: self.standing,
            life: self.life,
            order: self.order,
            news: self.news,
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

    /// The last sign of life of a client that is in control, or that a service
    /// [depends](super::Service::depends_on) on.
    #[must_use]
    pub fn last_sign(&self, client: JausId) -> Option<Instant> {
        self.life.last_sign(client)
    }

    /// Whether a setpoint is young enough, as far as its sender shows that, and newer, by the sender's sequence
    /// numbers, than its last one of its kind and than its last stop. If so it counts as the newest one from now on. If not
    /// it must not move anything: it was held up, is a late retransmission, or was overtaken. Such setpoints are
    /// counted ([`Stack::refused_setpoints`](super::Stack::refused_setpoints)).
    ///
    /// Call this once for each setpoint whose sender may command. [`Handlers`](super::Handlers) do
    /// it for their commands.
    pub fn admits_setpoint(
        &mut self,
        now: Instant,
        message: &Received,
        validity: Validity,
    ) -> bool {
        if validity == Validity::UntilDone {
            return self.order.admits(now, message, validity);
        }
        if self.life.is_late(message) {
            self.order.refuse(message, "it was held up");
            return false;
        }
        if !self.life.is_fresh(now, message.source) {
            self.order.refuse(message, "it may be too old");
            self.news.late = Some(message.source);
            return false;
        }
        self.order.admits(now, message, validity)
    }

    /// Notes a message of the service that stops what setpoints have started, such as Stop Mission:
    /// setpoints that its sender has sent before are no longer
    /// [admitted](Self::admits_setpoint). The stops of the core services are noted already.
    pub fn note_stop(&mut self, now: Instant, message: &Received) {
        self.order.note_turn(now, message);
    }

    /// Reports a fault. A component with Management goes to
    /// [`State::Failure`](super::State::Failure), which ends control. It stays there until every
    /// fault has been followed by a [recovery](Self::recover).
    pub fn fail(&mut self, cause: StopCause) {
        self.news.faults.push(Err(cause));
    }

    /// Reports that the cause of one [`fail`](Self::fail) is gone. After the last recovery the
    /// component goes to standby.
    pub fn recover(&mut self) {
        self.news.faults.push(Ok(()));
    }

    /// Gives control to a client, because the client in control has agreed or there is none. What
    /// moves stops, and a component with Management goes to standby. Has no effect in an emergency,
    /// failure or shutdown, and if the authority does not suffice for the component.
    pub const fn hand_over(&mut self, to: Controller) {
        self.news.handover = Some(to);
    }

    /// Sends a message to one component.
    pub fn send<M: Message>(&mut self, destination: JausId, message: &M) {
        self.out.send(destination, message);
    }

    /// Sends octets that begin with a message code to one component.
    pub fn send_octets(&mut self, destination: JausId, payload: Bytes) {
        self.out.send_octets(destination, payload);
    }

    /// Replies to the sender of a message alone, even to a broadcast, with the message's priority.
    pub fn reply<M: Message>(&mut self, to: &Received, message: &M) {
        self.out.reply(to, message);
    }

    /// Like [`reply`](Self::reply), with retransmission until the receiver acknowledges. For
    /// replies of many datagrams: the loss of one datagram would lose the whole reply.
    pub fn reply_until_acknowledged<M: Message>(&mut self, to: &Received, message: &M) {
        self.out.reply_until_acknowledged(to, message);
    }

    /// Like [`reply`](Self::reply), with a message that is encoded already.
    pub(super) fn reply_octets(&mut self, to: &Received, payload: Bytes) {
        self.out.send_octets_with(to.source, to.priority, payload);
    }

    /// Publishes a report, as [`Stack::publish`](super::Stack::publish) does, from within a
    /// service. It is an error in the log if no service of the component publishes it.
    pub fn publish<R: Report>(&mut self, report: R, sampled_at: SystemTime) {
        let publication = Publication::new(report, sampled_at);
        self.news.published.push(publication);
    }

    /// Reports that the answer to the query `Q` has changed, which notifies its subscribers.
    pub fn changed<Q: Query>(&mut self) {
        self.answer_changed(Q::CODE);
    }

    /// The same for a query with this code.
    pub(super) fn answer_changed(&mut self, query: u16) {
        self.news.changed.insert(query);
    }

    /// Reports that the last accepted command with this code has ended, and whether successfully.
    /// Clients that requested a command event are notified. Command events exist only for commands
    /// whose end a service [reports](super::Service::tells_end_of).
    pub fn ended(&mut self, command: u16, successful: bool) {
        self.news.ended.push((command, successful));
    }
}
