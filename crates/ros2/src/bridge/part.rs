//! The bridge as a component: the JAUS side and the ROS side together.

use std::convert::Infallible;
use std::sync::Arc;

use jaus::node::Recorder;
use jaus_vehicle::parts::{Part, PartError, Slot};
use jaus_zenoh::NetworkSettings;
use tokio::sync::mpsc;

use super::messages::Types;
use super::report_topics::ReportTopics;
use super::reports::Reports;
use super::topics::{TopicSettings, Topics};
use super::{Settings, run};
use crate::graph::Gid;
use crate::session::{self, Ros, SessionError};

/// A bridge between a JAUS vehicle and ROS 2.
///
/// ```no_run
/// # use jaus::component::Kind;
/// # use jaus::node::{Config, Node};
/// # use jaus_vehicle::parts::{Part, Slot};
/// use jaus_ros2::bridge::vehicle::Selection;
/// use jaus_ros2::bridge::{Bridge, Reports, Settings, TopicSettings};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::new(252, 1))?;
/// let slot = Slot::new(node.attach(1)?, node, Kind::OtherSubsystem, "ROS 2 bridge");
/// let settings = Settings::new(Selection { subsystem: 101, only: Vec::new() });
/// let topics = TopicSettings::new("/v101");
/// let bridge = Bridge::new(settings, topics, Reports::none(), &Default::default())?;
/// bridge.run(slot).await?;
/// # Ok(())
/// # }
/// ```
pub struct Bridge {
    settings: Settings,
    topics: Topics,
    reports: Reports,
    recorder: Option<Recorder<Gid>>,
}

/// Why a bridge cannot be created.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The ROS session, or a topic.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A message type.
    #[error("a type of ROS cannot be used: {0}")]
    Type(String),
}

/// Capacity of the queues between the two sides.
const QUEUE: usize = 1024;

impl Bridge {
    /// A bridge with these settings. It connects to the ROS network in the background.
    ///
    /// # Errors
    /// Settings that zenoh cannot use, or a malformed namespace.
    pub fn new(
        mut settings: Settings,
        topics: TopicSettings,
        reports: Reports,
        session: &session::Settings,
    ) -> Result<Self, BridgeError> {
        settings.map_frame.clone_from(&topics.frames.map);
        if !settings.rules.only_watch() {
            warn_without_proof(&session.network)?;
        }
        let types = Types::bundled().map_err(|error| BridgeError::Type(error.to_string()))?;
        let report_topics = ReportTopics::new(&reports).map_err(BridgeError::Type)?;
        let ros = Ros::open(session)?;
        let node = ros.node(&topics.namespace, NODE)?;
        let topics = Topics::new(ros, node, topics, Arc::new(types), report_topics);
        Ok(Self {
            settings,
            topics,
            reports,
            recorder: None,
        })
    }

    /// Records what the publishers of ROS may and may not do, for an audit log.
    #[must_use]
    pub fn recorded_by(mut self, recorder: Option<Recorder<Gid>>) -> Self {
        self.recorder = recorder;
        self
    }
}

/// Warns if links of the ROS network do not prove who is at their other end: every node that reaches it has the
/// rights of ROS.
fn warn_without_proof(network: &NetworkSettings) -> Result<(), SessionError> {
    if let Err(reason) = jaus_zenoh::check_proof(&network.config()?) {
        tracing::warn!(
            "whoever reaches this ROS network has the rights of --rights, because {reason}"
        );
    }
    Ok(())
}

/// The name of the node in the ROS graph.
const NODE: &str = "jaus_ros2";

impl Part for Bridge {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let time = slot.time.clone();
        let component = slot.component("ROS 2 bridge").live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let (inputs, received) = mpsc::channel(QUEUE);
        let (outputs, published) = mpsc::channel(QUEUE);
        let subscribed = self.topics.subscribe(&inputs);
        let _subscriptions = subscribed.map_err(|error| PartError::Broken(error.to_string()))?;
        let publishing = self.topics.publish_all(published);
        let running = run(
            component,
            time,
            self.settings,
            self.reports,
            self.recorder,
            (received, outputs),
        );
        tokio::select! {
            error = running => Err(error),
            ended = publishing => Err(match ended {
                Ok(()) => PartError::NodeStopped,
                Err(error) => PartError::Broken(error.to_string()),
            }),
        }
    }
}
