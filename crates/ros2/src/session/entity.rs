//! Nodes, publishers and subscriptions, as the application holds them.
#![expect(
    clippy::disallowed_methods,
    reason = "a message carries the time of sending"
)]

use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::SessionError;
use super::backlog::Backlog;
use super::shared::{Inbox, Incoming, Outgoing, Role, Shared, Topic};
use crate::cdr;
use crate::graph::{
    Attachment, Durability, Endpoint, History, NodeName, Qos, TopicName, topic_key,
};
use crate::interface::Interface;
use crate::message::Message;

/// An entity of the session. It is withdrawn when it is dropped.
#[derive(Debug)]
struct Registration {
    shared: Arc<Shared>,
    id: u64,
}

impl Drop for Registration {
    fn drop(&mut self) {
        self.shared.remove(self.id);
    }
}

/// A node. It exists until it and all that it has created are dropped.
#[derive(Clone, Debug)]
pub struct Node {
    registration: Arc<Registration>,
    name: NodeName,
}

impl Node {
    pub(super) fn new(shared: Arc<Shared>, name: NodeName) -> Self {
        let id = shared.add(None, name.clone(), Role::Node);
        let registration = Arc::new(Registration { shared, id });
        Self { registration, name }
    }

    /// The name.
    #[must_use]
    pub const fn name(&self) -> &NodeName {
        &self.name
    }

    /// Creates a publisher of a topic, whose full name begins with `/`.
    ///
    /// # Errors
    /// A malformed name, or transient local durability.
    pub fn publisher(
        &self,
        topic: &str,
        interface: &Arc<Interface>,
        qos: Qos,
    ) -> Result<Publisher, SessionError> {
        let role = Role::Publisher {
            topic: self.topic(topic, interface, qos)?,
            outgoing: Backlog::new(depth(&qos)),
        };
        Ok(Publisher {
            registration: self.add(role),
            interface: interface.clone(),
            _node: self.clone(),
        })
    }

    /// Creates a subscription of a topic, whose full name begins with `/`.
    ///
    /// # Errors
    /// A malformed name, or transient local durability.
    pub fn subscription(
        &self,
        topic: &str,
        interface: &Arc<Interface>,
        qos: Qos,
    ) -> Result<Subscription, SessionError> {
        let topic = self.topic(topic, interface, qos)?;
        let inbox = Arc::new(Inbox::new(topic.key.clone(), depth(&qos)));
        let role = Role::Subscription {
            topic,
            inbox: inbox.clone(),
        };
        Ok(Subscription {
            _registration: self.add(role),
            interface: interface.clone(),
            inbox,
            _node: self.clone(),
        })
    }

    fn topic(&self, topic: &str, interface: &Interface, qos: Qos) -> Result<Topic, SessionError> {
        if qos.durability == Durability::TransientLocal {
            return Err(SessionError::TransientLocal);
        }
        let topic: TopicName = topic.parse()?;
        Ok(Topic {
            key: topic_key(self.registration.shared.domain, &topic, interface),
            endpoint: Endpoint::new(&topic, interface, qos),
        })
    }

    fn add(&self, role: Role) -> Registration {
        let shared = self.registration.shared.clone();
        let node = Some(self.registration.id);
        let id = shared.add(node, self.name.clone(), role);
        Registration { shared, id }
    }
}

/// How many messages a queue keeps.
const fn depth(qos: &Qos) -> u64 {
    match qos.history {
        History::KeepLast => qos.depth,
        History::KeepAll => u64::MAX,
    }
}

/// A publisher of a topic.
#[derive(Debug)]
pub struct Publisher {
    registration: Registration,
    interface: Arc<Interface>,
    _node: Node,
}

impl Publisher {
    /// The type of the messages.
    #[must_use]
    pub const fn interface(&self) -> &Arc<Interface> {
        &self.interface
    }

    /// Sends a message to all subscriptions that exist now. While a link is congested messages wait, as
    /// many as the quality of service says, and at most 1000 and 8 MiB; the oldest are dropped and
    /// counted. Without a session there are no subscriptions, and the message is dropped.
    ///
    /// # Errors
    /// The message is of another type.
    pub fn publish(&self, message: &Message) -> Result<(), SessionError> {
        let is_same = Arc::ptr_eq(message.interface(), &self.interface);
        if !is_same && message.interface() != &self.interface {
            return Err(SessionError::Type {
                expected: self.interface.name().clone(),
                found: message.interface().name().clone(),
            });
        }
        let octets = cdr::encode(message);
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let stamp = since.map_or(0, |since| since.as_nanos());
        let stamp = i64::try_from(stamp).unwrap_or(i64::MAX);
        let id = self.registration.id;
        self.registration.shared.with(|state| {
            let entity = state
                .wanted
                .get_mut(&id)
                .filter(|_| state.session.is_some());
            if let Some(Role::Publisher { outgoing, .. }) = entity.map(|it| &mut it.role) {
                let (length, is_first) = (octets.len(), outgoing.is_empty());
                outgoing.push(Outgoing { octets, stamp }, length);
                if is_first {
                    state.ready.push_back(id);
                }
            }
        });
        Ok(())
    }

    /// How many messages were dropped because a link was congested.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        let state = self.registration.shared.lock();
        let entity = state.wanted.get(&self.registration.id);
        match entity.map(|it| &it.role) {
            Some(Role::Publisher { outgoing, .. }) => outgoing.dropped(),
            _ => 0,
        }
    }
}

/// A received message.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// The message.
    pub message: Message,
    /// Its number, its time of sending, and its publisher.
    pub attachment: Attachment,
    /// When the session received it.
    pub arrival: Instant,
}

/// What a subscription has lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SubscriptionCounters {
    /// Messages that the application did not take in time.
    pub dropped: u64,
    /// Messages that were too long, without rmw_zenoh's attachment, or not of the type.
    pub malformed: u64,
}

/// A subscription of a topic.
#[derive(Debug)]
pub struct Subscription {
    _registration: Registration,
    interface: Arc<Interface>,
    inbox: Arc<Inbox>,
    _node: Node,
}

impl Subscription {
    /// The type of the messages.
    #[must_use]
    pub const fn interface(&self) -> &Arc<Interface> {
        &self.interface
    }

    /// Waits for the next message. Malformed ones are counted and left out. Cancelling it loses
    /// nothing.
    pub async fn receive(&mut self) -> Received {
        loop {
            let incoming = self.inbox.pop().await;
            if let Some(received) = self.decode(&incoming) {
                return received;
            }
            // Otherwise a flood of malformed messages stops all other tasks of this thread.
            tokio::task::yield_now().await;
        }
    }

    /// The next message, if one waits.
    pub fn try_receive(&mut self) -> Option<Received> {
        loop {
            let next = self.inbox.lock().pop();
            if let Some(received) = self.decode(&next?) {
                return Some(received);
            }
        }
    }

    /// What was lost so far.
    #[must_use]
    pub fn counters(&self) -> SubscriptionCounters {
        SubscriptionCounters {
            dropped: self.inbox.lock().dropped(),
            malformed: self.inbox.malformed(),
        }
    }

    fn decode(&self, incoming: &Incoming) -> Option<Received> {
        match cdr::decode(&self.interface, &incoming.octets) {
            Ok(message) => Some(Received {
                message,
                attachment: incoming.attachment,
                arrival: incoming.arrival,
            }),
            Err(error) => {
                self.inbox.refuse(&error.to_string());
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;
    use std::task::{Context, Waker};

    use proptest::prelude::*;

    use super::super::run::receive_message;
    use super::*;
    use crate::cdr::LONGEST;
    use crate::graph::Gid;
    use crate::interface::Interfaces;

    const ATTACHMENT: Attachment = Attachment {
        sequence: 1,
        stamp: 0,
        gid: Gid([7; 16]),
    };

    /// A subscription of a `Twist`.
    fn subscription() -> Subscription {
        let name = NodeName::new("/", "rover").unwrap();
        let node = Node::new(Arc::new(Shared::new(0)), name);
        let interfaces = Interfaces::bundled().unwrap();
        let twist = interfaces.get("geometry_msgs/msg/Twist").unwrap();
        node.subscription("/a", &twist, Qos::default()).unwrap()
    }

    #[test]
    fn a_flood_of_malformed_messages_leaves_time_for_other_tasks() {
        let mut subscription = subscription();
        let inbox = subscription.inbox.clone();
        for _ in 1..=3 {
            let attachment = ATTACHMENT.encode().into();
            receive_message(&inbox, Some(&attachment), &vec![0; 3].into());
        }
        let mut receive = pin!(subscription.receive());
        let mut context = Context::from_waker(Waker::noop());
        for malformed in 1..=3 {
            assert!(receive.as_mut().poll(&mut context).is_pending());
            assert_eq!(inbox.malformed(), malformed);
        }
    }

    #[test]
    fn a_message_that_is_too_long_is_counted_and_does_not_wait() {
        let subscription = subscription();
        let attachment = ATTACHMENT.encode().into();
        let longer = vec![0; LONGEST + 1].into();
        receive_message(&subscription.inbox, Some(&attachment), &longer);
        assert_eq!(subscription.counters().malformed, 1);
        assert!(subscription.inbox.lock().is_empty());
    }

    proptest! {
        #[test]
        fn any_message_is_received_or_counted(
            // Both are too short, unless they are replaced.
            attachment in prop::option::of(prop::collection::vec(any::<u8>(), 0..33)),
            is_attached in prop::bool::weighted(0.7),
            mut payload in prop::collection::vec(any::<u8>(), 0..52),
            is_whole in prop::bool::weighted(0.7),
        ) {
            if is_whole {
                payload.resize(52, 0);
                payload[..4].copy_from_slice(&[0, 1, 0, 0]);
            }
            let mut subscription = subscription();
            let attachment = match is_attached {
                true => Some(ATTACHMENT.encode().into()),
                false => attachment.map(Into::into),
            };
            receive_message(&subscription.inbox, attachment.as_ref(), &payload.into());
            let received = subscription.try_receive();
            let counters = subscription.counters();
            prop_assert_eq!(u64::from(received.is_some()) + counters.malformed, 1);
            prop_assert_eq!(received.is_some(), is_attached && is_whole);
            prop_assert_eq!(counters.dropped, 0);
        }
    }
}
