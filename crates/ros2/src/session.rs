//! A session of ROS 2 over zenoh: nodes, publishers and subscriptions.
//!
//! Calls of zenoh may wait for a congested link, so that a thread of the session makes all of them; the
//! functions here return at once. What is created before the session is open, or while its router is
//! away, is declared as soon as it can be.

mod backlog;
mod entity;
mod run;
mod shared;

use std::sync::Arc;

use jaus_zenoh::{NetworkError, NetworkSettings};
use tokio::sync::watch;
use zenoh::config::Config;

pub use entity::{Node, Publisher, Received, Subscription, SubscriptionCounters};

use crate::graph::{Entity, EntityKind, GREATEST_DOMAIN, Gid, NameError, NodeName};
use crate::interface::TypeName;
use shared::Shared;

/// The settings of a session.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Settings {
    /// The zenoh network; by default the router of this host, `tcp/localhost:7447`.
    pub network: NetworkSettings,
    /// The domain, as `ROS_DOMAIN_ID` sets it: 0 to 232.
    pub domain: u32,
}

impl Default for Settings {
    fn default() -> Self {
        let mut network = NetworkSettings::default();
        network.connect = vec!["tcp/localhost:7447".to_owned()];
        Self { network, domain: 0 }
    }
}

/// Why a session, or something in it, cannot be created.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The settings of the network cannot be used.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The name of a topic or a node is malformed.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The domain is too great.
    #[error("{0} is not a domain of ROS 2: choose 0 to {GREATEST_DOMAIN}")]
    Domain(u32),
    /// The durability is not supported.
    #[error("transient local durability is not supported: use volatile")]
    TransientLocal,
    /// A message is of another type than its publisher.
    #[error("the topic has messages of the type {expected}, not {found}")]
    Type {
        /// The type of the publisher.
        expected: TypeName,
        /// The type of the message.
        found: TypeName,
    },
    /// The system refuses a thread.
    #[error("the thread of the session does not start: {0}")]
    Thread(std::io::Error),
}

/// A session of ROS 2. It ends, and all that it declared is withdrawn, when the last clone is dropped or
/// one is closed.
#[derive(Clone, Debug)]
pub struct Ros {
    handle: Arc<Handle>,
}

#[derive(Debug)]
struct Handle {
    shared: Arc<Shared>,
}

impl Drop for Handle {
    fn drop(&mut self) {
        self.shared.close();
    }
}

impl Ros {
    /// Opens a session. It connects in the background, and tries again every second until it has
    /// a connection.
    ///
    /// # Errors
    /// Settings that cannot be used.
    pub fn open(settings: &Settings) -> Result<Self, SessionError> {
        if settings.domain > GREATEST_DOMAIN {
            return Err(SessionError::Domain(settings.domain));
        }
        let config = config(&settings.network)?;
        let shared = Arc::new(Shared::new(settings.domain));
        let for_thread = shared.clone();
        std::thread::Builder::new()
            .name("ros2".to_owned())
            .spawn(move || run::run(&for_thread, &config))
            .map_err(SessionError::Thread)?;
        let handle = Arc::new(Handle { shared });
        Ok(Self { handle })
    }

    /// Creates a node. It exists until it and all that it has created are dropped.
    ///
    /// # Errors
    /// A malformed name.
    pub fn node(&self, namespace: &str, name: &str) -> Result<Node, SessionError> {
        let name = NodeName::new(namespace, name)?;
        Ok(Node::new(self.shared().clone(), name))
    }

    /// Whether the session has a connection to a router or another session now. Loss of the
    /// connection is noticed within the time that zenoh's settings give, 10 s by default, and a second.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.shared().lock().is_connected
    }

    /// The publishers of a topic in other sessions.
    #[must_use]
    pub fn publishers(&self, topic: &str) -> Vec<Entity> {
        self.others(EntityKind::Publisher, topic, Entity::clone)
    }

    /// The subscriptions of a topic in other sessions.
    #[must_use]
    pub fn subscriptions(&self, topic: &str) -> Vec<Entity> {
        self.others(EntityKind::Subscription, topic, Entity::clone)
    }

    /// A part of each entity of a topic in other sessions. The session waits meanwhile.
    pub(crate) fn others<T, C: FromIterator<T>>(
        &self,
        kind: EntityKind,
        topic: &str,
        part: impl FnMut(&Entity) -> T,
    ) -> C {
        let state = self.shared().lock();
        let entities = state.graph.of_topic(kind, topic);
        let is_other = |it: &&Entity| Some(&it.token.session) != state.session.as_ref();
        entities.filter(is_other).map(part).collect()
    }

    /// The publisher of a topic with this identity, if its token exists. Who sends with a made-up identity has
    /// none.
    #[must_use]
    pub fn publisher(&self, topic: &str, gid: Gid) -> Option<Entity> {
        let state = self.shared().lock();
        let mut publishers = state.graph.of_topic(EntityKind::Publisher, topic);
        publishers.find(|it| it.gid == gid).cloned()
    }

    /// A number that changes when the connection, or the publishers and subscriptions of others change.
    #[must_use]
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.shared().changes()
    }

    /// Ends the session, and waits until all that it declared is withdrawn.
    pub async fn close(self) {
        self.shared().close();
        let mut ended = self.shared().ended();
        // The sender is in `shared`, which is alive.
        let _ = ended.wait_for(|ended| *ended).await;
    }

    fn shared(&self) -> &Arc<Shared> {
        &self.handle.shared
    }
}

/// The settings for zenoh, with timestamps as rmw_zenoh has them; a settings file decides for itself.
fn config(network: &NetworkSettings) -> Result<Config, NetworkError> {
    let mut config = network.config()?;
    let setting = "timestamping/enabled";
    if network.file.is_none() {
        let inserted = config.insert_json5(setting, "true");
        inserted.map_err(|error| NetworkError::Setting {
            setting,
            reason: error.to_string(),
        })?;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_have_timestamps_and_a_domain_of_ros() {
        let settings = Settings::default();
        let config = config(&settings.network).unwrap();
        assert_eq!(config.get_json("timestamping/enabled").unwrap(), "true");
        let endpoints = config.get_json("connect/endpoints").unwrap();
        assert_eq!(endpoints, "[\"tcp/localhost:7447\"]");
        let settings = Settings {
            domain: 233,
            ..Settings::default()
        };
        let error = Ros::open(&settings).unwrap_err().to_string();
        assert!(error.contains("0 to 232"), "{error}");
    }
}
