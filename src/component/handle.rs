//! The application's end of a component.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::{mpsc, oneshot, watch};

use super::clients::{Hold, NotControlled, NotSubscribed};
use super::driver::{Answer, Command};
use super::watch::Outlet;
use super::{
    Builder, Control, ControlError, DeliverError, FindError, Messages, QueryError, SendError,
    SubscribeError, Subscription, Watch,
};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::{Outgoing, Received};
use crate::node;
use crate::service::{
    Change, Condition, Directory, Kind, NodeDirectory, Offer, Service, Standing, Topic,
    UnsafeService, When,
};
use crate::wire::Priority;

/// A component that lives on a node. Cheap to clone; it stops when the last clone is dropped.
#[derive(Debug, Clone)]
pub struct Component {
    pub(super) shared: Arc<Shared>,
}

#[derive(Debug)]
pub(super) struct Shared {
    pub(super) sender: node::Sender,
    pub(super) commands: mpsc::Sender<Command>,
    pub(super) known: Arc<NodeDirectory>,
    pub(super) directories: watch::Receiver<()>,
    pub(super) standings: watch::Receiver<Standing>,
    pub(super) changes: Arc<Outlet<Change>>,
    pub(super) messages: Arc<Outlet<Received>>,
}

impl Shared {
    /// Commands that may wait for the component's task.
    pub(super) const COMMANDS: usize = 64;
    /// Changes that a [`Watch`] may lag behind.
    pub(super) const CHANGES: usize = 1024;
    /// Messages that a [`Messages`] may lag behind.
    pub(super) const MESSAGES: usize = 256;
}

impl Component {
    /// How long [`find`](Self::find) looks before it gives up.
    pub const FIND_LIMIT: Duration = Duration::from_secs(10);
    /// How many services of other versions a [`FindError`] names.
    const MOST_INSTEAD: usize = 8;

    /// A new component: what the subsystem is, and what it is called.
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

    /// Everybody who is known now, this component included.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.shared.known.directory()
    }

    /// The state of this component, and who controls it.
    #[must_use]
    pub fn standing(&self) -> Standing {
        *self.shared.standings.borrow()
    }

    /// The same, to wait for changes of it.
    #[must_use]
    pub fn watch_standing(&self) -> watch::Receiver<Standing> {
        self.shared.standings.clone()
    }

    /// Tells how this component is, which Management shows to everybody.
    pub async fn set_condition(&self, condition: Condition) {
        // An error means that the component has stopped.
        let _ = self
            .shared
            .commands
            .send(Command::Condition(condition))
            .await;
    }

    /// Tells whoever subscribed to the query `Q` that its answer is another now.
    pub async fn changed<Q: Message>(&self) {
        // As in `set_condition`.
        let _ = self.shared.commands.send(Command::Announce(Q::CODE)).await;
    }

    /// Tells that the command of type `C` which was last carried out has ended, and whether it has
    /// done what it was to do: for services that [`tell_end_of`](crate::service::Handlers::tell_end_of)
    /// it.
    pub async fn ended<C: Message>(&self, successful: bool) {
        // As in `set_condition`.
        let _ = self
            .shared
            .commands
            .send(Command::End(C::CODE, successful))
            .await;
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

    /// Sends a message and forgets it.
    ///
    /// # Errors
    /// If the wire cannot carry it or the node would not take it. That it was sent does not mean
    /// that it arrives.
    pub fn send<M: Message>(&self, destination: JausId, message: &M) -> Result<(), SendError> {
        self.send_with(Priority::Standard, destination, message)
    }

    /// The same as [`send`](Self::send), with a priority: more urgent messages overtake others in
    /// every queue on their way.
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

    /// Sends a message, again and again if need be, and waits until the receiver acknowledges it.
    /// Dropping the future forgets the message, which may still arrive.
    ///
    /// # Errors
    /// [`DeliverError`] says why it is not known to have arrived.
    pub async fn deliver<M: Message>(
        &self,
        destination: JausId,
        message: &M,
    ) -> Result<(), DeliverError> {
        self.deliver_with(Priority::Standard, destination, message)
            .await
    }

    /// The same as [`deliver`](Self::deliver), with a priority.
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

    /// Asks a component, and waits for its answer; asks again if none comes.
    ///
    /// A `peer` with wildcards stands for whoever answers first.
    ///
    /// # Errors
    /// [`QueryError`] says who did not answer what, and how long it was waited for.
    pub async fn query<R: Message, Q: Message>(
        &self,
        peer: JausId,
        query: &Q,
    ) -> Result<R, QueryError> {
        let not_sent = |source| QueryError::NotSent {
            peer,
            query: Q::NAME,
            source,
        };
        let payload = query.encode().map_err(|error| not_sent(error.into()))?;
        let (reply, answer) = oneshot::channel();
        let command = Command::Ask {
            peer,
            query: payload,
            report: R::CODE,
            reply,
        };
        let sent = self.shared.commands.send(command).await;
        sent.map_err(|_| QueryError::Stopped)?;
        match answer.await.map_err(|_| QueryError::Stopped)? {
            Answer::Report(octets) => R::decode(&octets).map_err(|source| QueryError::Unreadable {
                peer,
                query: Q::NAME,
                source,
            }),
            Answer::None(failure) => Err(QueryError::no_answer(Q::NAME, R::NAME, &failure)),
            Answer::NotSent(error) => Err(not_sent(error.into())),
        }
    }

    /// Has a component answer a query again and again, and waits until it confirms that.
    ///
    /// The subscription then lasts until it is dropped, whatever becomes of the peer; see
    /// [`Subscription`]. A peer that answers queries but does not offer the service Events
    /// cannot be subscribed to.
    ///
    /// # Errors
    /// [`SubscribeError`] says what the peer has against it, or how long it was silent.
    pub async fn subscribe<R: Message, Q: Message>(
        &self,
        peer: JausId,
        query: &Q,
        when: When,
    ) -> Result<Subscription<R>, SubscribeError> {
        let query_message = query.encode().map_err(|error| SubscribeError::Impossible {
            peer,
            query: Q::NAME,
            why: error.into(),
        })?;
        let topic = Topic {
            peer,
            query: query_message,
            report: R::CODE,
            when,
        };
        self.subscribe_to(topic, Q::NAME).await
    }

    /// Subscribes to a topic, whose query is called `query`.
    pub(super) async fn subscribe_to<R: Message>(
        &self,
        topic: Topic,
        query: &'static str,
    ) -> Result<Subscription<R>, SubscribeError> {
        let peer = topic.peer;
        let subscribed = self.hold(|reply| Hold::Subscribe { topic, reply }).await;
        match subscribed.ok_or(SubscribeError::Stopped)? {
            Ok((ticket, feed)) => Ok(Subscription::new(ticket, self.clone(), peer, feed)),
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

    /// Takes control of a component, and waits until it grants that. An `authority` is from 0 to
    /// 255; the greater one wins.
    ///
    /// # Errors
    /// [`ControlError`] says why control was not granted, or how long the peer was silent.
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

    /// Has the component's task carry something out; `None` when it has stopped.
    async fn hold<T>(&self, hold: impl FnOnce(oneshot::Sender<T>) -> Hold) -> Option<T> {
        let (reply, answer) = oneshot::channel();
        let command = Command::Hold(hold(reply));
        self.shared.commands.send(command).await.ok()?;
        answer.await.ok()
    }

    /// Waits until another component is known that offers a service, in whatever version, for at
    /// most [`FIND_LIMIT`](Self::FIND_LIMIT). Which version it is stands in the
    /// [`directory`](Self::directory).
    ///
    /// # Errors
    /// [`FindError`] says how long it was looked for.
    pub async fn find(&self, urn: &str) -> Result<JausId, FindError> {
        self.find_within(urn, Self::FIND_LIMIT).await
    }

    /// The same as [`find`](Self::find), with another limit.
    ///
    /// # Errors
    /// [`FindError`] says how long it was looked for.
    pub async fn find_within(&self, urn: &str, limit: Duration) -> Result<JausId, FindError> {
        self.search(&Sought::Service(urn), limit, |others| {
            who(others, |offer| offer.urn == urn)
        })
        .await
    }

    /// Waits until another component is known that offers a service in a version that a client
    /// made for `wanted` can use: the same major version, and no older minor one.
    ///
    /// # Errors
    /// [`FindError`] says how long it was looked for, and who offers other versions.
    pub async fn find_version(&self, wanted: ServiceId) -> Result<JausId, FindError> {
        self.find_version_within(wanted, Self::FIND_LIMIT).await
    }

    /// The same as [`find_version`](Self::find_version), with another limit.
    ///
    /// # Errors
    /// Those of [`find_version`](Self::find_version).
    pub async fn find_version_within(
        &self,
        wanted: ServiceId,
        limit: Duration,
    ) -> Result<JausId, FindError> {
        self.search(&Sought::OneOf(&[wanted]), limit, |others| {
            who(others, |offer| offer.serves(wanted))
        })
        .await
    }

    /// Waits until another component is known that offers exactly one of `versions`, and says which
    /// of them to speak with it: where versions differ on the wire, the one whose messages it
    /// understands. The versions that the client knows are given with the one that it likes best
    /// first; it gets that one if anybody offers it.
    ///
    /// # Errors
    /// [`FindError`] says how long it was looked for, and who offers other versions.
    pub async fn find_common_version(
        &self,
        versions: &[ServiceId],
    ) -> Result<(JausId, ServiceId), FindError> {
        self.find_common_version_within(versions, Self::FIND_LIMIT)
            .await
    }

    /// The same as [`find_common_version`](Self::find_common_version), with another limit.
    ///
    /// # Errors
    /// Those of [`find_common_version`](Self::find_common_version).
    pub async fn find_common_version_within(
        &self,
        versions: &[ServiceId],
        limit: Duration,
    ) -> Result<(JausId, ServiceId), FindError> {
        self.search(&Sought::OneOf(versions), limit, |others| {
            versions.iter().find_map(|&version| {
                let exactly = Offer::from(version);
                Some((who(others, |offer| *offer == exactly)?, version))
            })
        })
        .await
    }

    /// Waits until `found` finds what it wants among the other components.
    async fn search<T>(
        &self,
        sought: &Sought<'_>,
        limit: Duration,
        found: impl Fn(&Others<'_>) -> Option<T>,
    ) -> Result<T, FindError> {
        let start = Instant::now();
        let own = self.id();
        let mut result = None;
        let mut directories = self.shared.directories.clone();
        let known = directories.wait_for(|()| {
            let directory = &self.directory();
            result = found(&Others { directory, own });
            result.is_some()
        });
        match tokio::time::timeout(limit, known).await {
            Ok(Ok(_)) => result.ok_or(FindError::Stopped),
            Ok(Err(_)) => Err(FindError::Stopped),
            Err(_) => Err(self.not_found(sought, start.elapsed())),
        }
    }

    fn not_found(&self, sought: &Sought<'_>, waited: Duration) -> FindError {
        let directory = self.directory();
        let others = directory.components().filter(|it| it.id != self.id());
        let offers = others.flat_map(|it| it.offered().map(move |offer| (it.id, offer)));
        FindError::NotFound {
            service: sought.to_string(),
            waited,
            others: directory.len().saturating_sub(1),
            instead: offers
                .filter(|(_, offer)| sought.is_of(&offer.urn))
                .map(|(id, offer)| (id, offer.clone()))
                .take(Self::MOST_INSTEAD)
                .collect(),
        }
    }

    /// Offers one more service, and tells the peers. Without effect if the component has stopped.
    ///
    /// # Errors
    /// If the service is [not safe](UnsafeService) by itself.
    pub async fn offer(&self, service: impl Service + 'static) -> Result<(), UnsafeService> {
        let (reply, answer) = oneshot::channel();
        let command = Command::Offer(Box::new(service), reply);
        // An error, here and below, means that the component has stopped.
        let _ = self.shared.commands.send(command).await;
        answer.await.unwrap_or(Ok(()))
    }

    /// Takes a service back, in all its versions, and tells the peers.
    pub async fn withdraw(&self, urn: &'static str) {
        // As in `set_condition`.
        let _ = self.shared.commands.send(Command::Withdraw(urn)).await;
    }
}

/// What is looked for.
enum Sought<'a> {
    /// A service, in whatever version.
    Service(&'a str),
    /// A service in one of several versions.
    OneOf(&'a [ServiceId]),
}

impl Sought<'_> {
    /// Whether it is about the service with this URN.
    fn is_of(&self, urn: &str) -> bool {
        match self {
            Self::Service(wanted) => *wanted == urn,
            Self::OneOf(versions) => versions.iter().any(|version| version.urn == urn),
        }
    }
}

impl fmt::Display for Sought<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Service(urn) => f.write_str(urn),
            Self::OneOf(versions) => {
                for (place, version) in versions.iter().enumerate() {
                    let gap = if place == 0 { "" } else { " or " };
                    write!(f, "{gap}{version}")?;
                }
                Ok(())
            }
        }
    }
}

/// All known components but the one that looks.
struct Others<'a> {
    directory: &'a Directory,
    own: JausId,
}

/// The first of them with an offer that will do.
fn who(others: &Others<'_>, will_do: impl Fn(&Offer) -> bool) -> Option<JausId> {
    let mut components = others.directory.components();
    let found = components.find(|it| it.id != others.own && it.offered().any(&will_do));
    found.map(|component| component.id)
}
