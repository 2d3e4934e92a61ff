//! The application's handle to a component.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicU8, AtomicU64};
use std::time::SystemTime;

use bytes::Bytes;
use tokio::sync::{mpsc, oneshot, watch};

use super::clients::{Hold, NotControlled, NotSubscribed};
use super::driver::{Answer, Ask, Command};
use super::latest::LatestSender;
use super::offers::missing_for;
use super::watch::Outlet;
use super::{
    Builder, Control, ControlError, DeliverError, FromReport, Messages, OfferError, PublishError,
    QueryError, SendError, StopReason, Stopped, SubscribeError, Subscription, Watch,
};
use crate::address::JausId;
use crate::codec::{Echo, Message, Query, Report};
use crate::endpoint::{Outgoing, Received};
use crate::messages;
use crate::service::{
    Change, Condition, Directory, Kind, LaterAnswer, NodeDirectory, Publication, QueryOptions,
    Question, Service, Standing, Topic, When,
};
use crate::wire::Priority;

/// A component on a node. Cheap to clone; it stops when the last clone is dropped.
///
/// ```no_run
/// # use jaus::component::{Component, Kind};
/// # use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
/// # use jaus::node::{Config, Node};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::new(42, 1))?;
/// let operator = Component::builder(Kind::OperatorControlUnit, "Operator").attach(&node, 1)?;
/// let sensor = operator.find(velocity_state_sensor::URN).await?;
/// let report = operator.query(sensor, &QueryVelocityState::all()).await?;
/// println!("{sensor}: {:?} m/s", report.velocity_x_m_per_s());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Component {
    pub(super) shared: Arc<Shared>,
}

#[derive(Debug)]
pub(super) struct Shared {
    pub(super) sender: LatestSender,
    pub(super) commands: mpsc::Sender<Command>,
    pub(super) known: Arc<NodeDirectory>,
    pub(super) directories: watch::Receiver<()>,
    pub(super) standings: watch::Receiver<Standing>,
    pub(super) stopped: watch::Receiver<Option<StopReason>>,
    pub(super) refused_setpoints: Arc<AtomicU64>,
    pub(super) changes: Arc<Outlet<Change>>,
    pub(super) messages: Arc<Outlet<Received>>,
    /// The number of the next request.
    pub(super) requests: AtomicU8,
}

impl Shared {
    /// Limit of commands that wait for the component's task.
    pub(super) const COMMANDS: usize = 64;
    /// How many changes a [`Watch`] may lag behind.
    pub(super) const CHANGES: usize = 1024;
    /// How many messages a [`Messages`] may lag behind.
    pub(super) const MESSAGES: usize = 256;
}

impl Component {
    /// A builder for a new component: the kind and the name of its subsystem.
    pub fn builder(kind: Kind, name: impl Into<String>) -> Builder {
        Builder::new(kind, name)
    }

    pub(super) fn new(shared: Shared) -> Self {
        Self {
            shared: Arc::new(shared),
        }
    }

    /// The component's id.
    #[must_use]
    pub fn id(&self) -> JausId {
        self.shared.sender.id()
    }

    /// All known components, including this one.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.shared.known.directory()
    }

    /// The state of this component, and the client in control.
    #[must_use]
    pub fn standing(&self) -> Standing {
        *self.shared.standings.borrow()
    }

    /// The same, as a channel that reports changes.
    #[must_use]
    pub fn watch_standing(&self) -> watch::Receiver<Standing> {
        self.shared.standings.clone()
    }

    /// How many setpoints the component has refused because their senders had superseded them:
    /// they were late, or retransmitted.
    #[must_use]
    pub fn refused_setpoints(&self) -> u64 {
        self.shared.refused_setpoints.load(Relaxed)
    }

    /// Waits until the component has stopped, and says why. From then on its [`standing`](Self::standing)
    /// is that of a component that is shut down or has failed, and the other methods return `Stopped`.
    pub async fn stopped(&self) -> StopReason {
        let mut stopped = self.shared.stopped.clone();
        // The sender says why before it goes.
        let reason = stopped.wait_for(Option::is_some).await;
        reason.ok().and_then(|it| *it).unwrap_or(StopReason::Ended)
    }

    /// Passes a command to the component's task.
    async fn command(&self, command: Command) -> Result<(), Stopped> {
        let sent = self.shared.commands.send(command).await;
        sent.map_err(|_| Stopped)
    }

    /// Sets the condition of this component, which Management reports to clients.
    ///
    /// # Errors
    /// If the component has stopped.
    pub async fn set_condition(&self, condition: Condition) -> Result<(), Stopped> {
        self.command(Command::Condition(condition)).await
    }

    /// Publishes a report: queries are answered with it from now on, subscribers on change get it
    /// at once, and periodic reports carry it. A service must be
    /// [offered](super::Handlers::publishes) that publishes it.
    ///
    /// `sampled_at` is the time of the sample (UTC). The report's time fields get it, unless they
    /// are set or the definition has none.
    ///
    /// # Errors
    /// [`PublishError`] names the report that no service publishes.
    pub async fn publish<R: Report>(
        &self,
        report: R,
        sampled_at: SystemTime,
    ) -> Result<(), PublishError> {
        let publication = Publication::new(report, sampled_at);
        let (reply, taken) = oneshot::channel();
        let command = Command::Publish(publication, reply);
        let sent = self.command(command).await;
        sent.map_err(|_| PublishError::Stopped)?;
        Ok(taken.await.map_err(|_| PublishError::Stopped)??)
    }

    /// Notifies the subscribers of the query `Q` that its answer has changed.
    ///
    /// # Errors
    /// If the component has stopped.
    pub async fn changed<Q: Query>(&self) -> Result<(), Stopped> {
        self.command(Command::Announce(Q::CODE)).await
    }

    /// Reports that the last accepted command of type `C` has ended, and whether it was successful.
    /// For services that [`tell_end_of`](crate::service::Handlers::tell_end_of) it.
    ///
    /// # Errors
    /// If the component has stopped.
    pub async fn ended<C: Message>(&self, successful: bool) -> Result<(), Stopped> {
        self.command(Command::End(C::CODE, successful)).await
    }

    /// The changes of the directory from now on.
    #[must_use]
    pub fn watch(&self) -> Watch {
        Watch::new(self.shared.changes.listen())
    }

    /// The messages from now on that no service handles.
    #[must_use]
    pub fn messages(&self) -> Messages {
        Messages::new(self.shared.messages.listen())
    }

    /// Sends a message without acknowledgement.
    ///
    /// # Errors
    /// If the wire cannot carry it or the node rejects it. Success does not mean that it arrives.
    pub fn send<M: Message>(&self, destination: JausId, message: &M) -> Result<(), SendError> {
        self.send_with(Priority::Standard, destination, message)
    }

    /// Like [`send`](Self::send), with a priority: messages with a higher priority overtake others
    /// in every queue.
    ///
    /// # Errors
    /// Those of [`send`](Self::send).
    pub fn send_with<M: Message>(
        &self,
        priority: Priority,
        destination: JausId,
        message: &M,
    ) -> Result<(), SendError> {
        let payload = message.encode()?;
        let outgoing = Outgoing {
            priority,
            ..Outgoing::new(self.id(), destination, payload)
        };
        self.shared.sender.send(outgoing)?;
        Ok(())
    }

    /// Sends a message, with retransmission, and waits until the receiver acknowledges it. Dropping
    /// the future cancels the message: it is not sent or retransmitted any more. A copy that is
    /// already on the way may still arrive.
    ///
    /// A setpoint of the standard's mobility and manipulator services is cancelled as well when this
    /// component sends the same peer a newer one, or a stop (release, standby, reset, shutdown,
    /// emergency). Setpoints that are repeated anyway need no acknowledgement: [`send`](Self::send)
    /// them, and `deliver` the stop.
    ///
    /// # Errors
    /// [`DeliverError`] gives the reason why delivery is not confirmed.
    pub async fn deliver<M: Message>(
        &self,
        destination: JausId,
        message: &M,
    ) -> Result<(), DeliverError> {
        self.deliver_with(Priority::Standard, destination, message)
            .await
    }

    /// Like [`deliver`](Self::deliver), with a priority.
    ///
    /// # Errors
    /// Those of [`deliver`](Self::deliver).
    pub async fn deliver_with<M: Message>(
        &self,
        priority: Priority,
        destination: JausId,
        message: &M,
    ) -> Result<(), DeliverError> {
        let payload = message.encode()?;
        let outgoing = Outgoing {
            priority,
            ..Outgoing::new(self.id(), destination, payload)
        };
        Ok(self.shared.sender.deliver(outgoing).await?)
    }

    /// Answers a query that a service of this component has [put off](crate::service::Call::later).
    ///
    /// # Errors
    /// Those of [`send`](Self::send).
    pub fn answer<Q: Query>(
        &self,
        later: LaterAnswer<Q>,
        report: Q::Report,
    ) -> Result<(), SendError> {
        self.shared.sender.send(later.into_outgoing(report)?)?;
        Ok(())
    }

    /// Sends a query to a component, and waits for its report; repeats the query on timeout, but
    /// not while parts of a large report arrive.
    ///
    /// If `peer` has wildcards, the first answer of any matching component counts.
    ///
    /// # Errors
    /// [`QueryError`] names the peer and the query, and how long it waited.
    pub async fn query<Q: Query>(&self, peer: JausId, query: &Q) -> Result<Q::Report, QueryError> {
        self.query_with(QueryOptions::default(), peer, query).await
    }

    /// Like [`query`](Self::query), with a priority and with its own patience.
    ///
    /// # Errors
    /// Those of [`query`](Self::query).
    pub async fn query_with<Q: Query>(
        &self,
        options: QueryOptions,
        peer: JausId,
        query: &Q,
    ) -> Result<Q::Report, QueryError> {
        self.ask_for(options, peer, query, Some(Q::ECHOES)).await
    }

    /// Like [`query`](Self::query), for a message whose answer does not follow from its type: a
    /// request with a confirmation, or a query to a peer that reports in the layout of an older
    /// version.
    ///
    /// # Errors
    /// Those of [`query`](Self::query).
    pub async fn request<R: Message, M: Message>(
        &self,
        peer: JausId,
        message: &M,
    ) -> Result<R, QueryError> {
        self.request_with(QueryOptions::default(), peer, message)
            .await
    }

    /// Like [`request`](Self::request), with a priority and with its own patience.
    ///
    /// # Errors
    /// Those of [`query`](Self::query).
    pub async fn request_with<R: Message, M: Message>(
        &self,
        options: QueryOptions,
        peer: JausId,
        message: &M,
    ) -> Result<R, QueryError> {
        self.ask_for(options, peer, message, None).await
    }

    async fn ask_for<R: Message, M: Message>(
        &self,
        options: QueryOptions,
        peer: JausId,
        message: &M,
        echoes: Option<&'static [Echo]>,
    ) -> Result<R, QueryError> {
        let names = (M::NAME, R::NAME);
        let query = message.encode().map_err(|error| QueryError::NotSent {
            peer,
            query: M::NAME,
            source: error.into(),
        })?;
        let question = Question::new(query, R::CODE);
        let question = match echoes {
            Some(echoes) => question.echoing(echoes),
            None => question,
        };
        let octets = self.ask(options, peer, question, names).await?;
        R::decode(&octets).map_err(|source| QueryError::Unreadable {
            peer,
            query: M::NAME,
            source,
        })
    }

    /// Asks a question, and waits for its answer. The names are those of the query and of the report.
    pub(super) async fn ask(
        &self,
        options: QueryOptions,
        peer: JausId,
        question: Question,
        names: (&'static str, &'static str),
    ) -> Result<Bytes, QueryError> {
        let (name, report_name) = names;
        let code = question.code();
        let directory = self.directory();
        let services = directory.component(peer).map_or_else(Vec::new, |peer| {
            missing_for(&messages::registry(), peer, code)
        });
        if !services.is_empty() {
            return Err(QueryError::NotOffered {
                peer,
                query: name,
                services,
            });
        }
        let (reply, answer) = oneshot::channel();
        let command = Command::Ask(Box::new(Ask {
            peer,
            question,
            options,
            reply,
        }));
        let sent = self.command(command).await;
        sent.map_err(|_| QueryError::Stopped)?;
        match answer.await.map_err(|_| QueryError::Stopped)? {
            Answer::Report(octets) => Ok(octets),
            Answer::None(failure) => Err(QueryError::no_answer(name, report_name, &failure)),
            Answer::NotSent(error) => Err(QueryError::NotSent {
                peer,
                query: name,
                source: error.into(),
            }),
        }
    }

    /// Subscribes to the answers to a query, and waits until the component confirms.
    ///
    /// The subscription then lasts until it is dropped, even if the peer fails; see
    /// [`Subscription`]. A peer that answers queries but does not offer the Events service cannot
    /// be subscribed to.
    ///
    /// # Errors
    /// [`SubscribeError`] gives the peer's reason, or how long it was silent.
    pub async fn subscribe<Q: Query>(
        &self,
        peer: JausId,
        query: &Q,
        when: When,
    ) -> Result<Subscription<Q::Report>, SubscribeError> {
        let query_message = query.encode().map_err(|error| SubscribeError::Impossible {
            peer,
            query: Q::NAME,
            why: error.into(),
        })?;
        let topic = Topic {
            peer,
            query: query_message,
            report: Q::Report::CODE,
            when,
        };
        self.subscribe_to(topic, Q::NAME).await
    }

    /// Subscribes to a topic; `query` is the name of its query.
    pub(super) async fn subscribe_to<R: FromReport>(
        &self,
        topic: Topic,
        query: &'static str,
    ) -> Result<Subscription<R>, SubscribeError> {
        let peer = topic.peer;
        let subscribed = self.hold(|reply| Hold::Subscribe { topic, reply }).await;
        match subscribed.ok_or(SubscribeError::Stopped)? {
            Ok((ticket, reader)) => Ok(Subscription::new(ticket, self.clone(), peer, reader)),
            Err(NotSubscribed::Impossible(why)) => {
                Err(SubscribeError::Impossible { peer, query, why })
            }
            Err(NotSubscribed::Ended(why)) => Err(SubscribeError::Ended { peer, query, why }),
            Err(NotSubscribed::NotSent(error)) => Err(SubscribeError::NotSent {
                peer,
                query,
                source: error.into(),
            }),
        }
    }

    /// Requests control of a component, and waits until it is granted. `authority` is from 0 to
    /// 255; the higher one wins.
    ///
    /// # Errors
    /// [`ControlError`] gives the reason why control was not granted, or how long the peer was
    /// silent.
    pub async fn control(&self, peer: JausId, authority: u8) -> Result<Control, ControlError> {
        let controlled = self
            .hold(|reply| Hold::Control {
                peer,
                authority,
                reply,
            })
            .await;
        match controlled.ok_or(ControlError::Stopped)? {
            Ok((ticket, condition)) => Ok(Control::new(ticket, self.clone(), peer, condition)),
            Err(NotControlled::Refused(why)) => Err(ControlError::Refused { peer, why }),
            Err(NotControlled::NotSent(error)) => Err(SendError::from(error).into()),
        }
    }

    /// Passes a request to the component's task; `None` when it has stopped.
    pub(super) async fn hold<T>(&self, hold: impl FnOnce(oneshot::Sender<T>) -> Hold) -> Option<T> {
        let (reply, answer) = oneshot::channel();
        let command = Command::Hold(Box::new(hold(reply)));
        self.command(command).await.ok()?;
        answer.await.ok()
    }

    /// Offers another service, and notifies the peers.
    ///
    /// # Errors
    /// If the component lacks what the service needs to be [safe](crate::service::UnsafeService), or has
    /// stopped.
    pub async fn offer(&self, service: impl Service + 'static) -> Result<(), OfferError> {
        let (reply, answer) = oneshot::channel();
        self.command(Command::Offer(Box::new(service), reply))
            .await?;
        Ok(answer.await.map_err(|_| Stopped)??)
    }

    /// Withdraws a service, in all its versions, and notifies the peers.
    ///
    /// # Errors
    /// If the component has stopped.
    pub async fn withdraw(&self, urn: &'static str) -> Result<(), Stopped> {
        self.command(Command::Withdraw(urn)).await
    }
}
