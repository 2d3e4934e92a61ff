//! The ROS side: the topics of a vehicle, as publishers and subscriptions of one node.

use std::collections::BTreeSet;
use std::sync::Arc;

use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::messages::{Frames, Types, read_goal, read_twist};
use super::ports::{Input, Output};
use super::report_topics::ReportTopics;
use super::samples::PoseSample;
use crate::graph::{Gid, Qos};
use crate::interface::Interface;
use crate::message::{Message, ValueError};
use crate::session::{Node, Publisher, Received, Ros, SessionError, Subscription};

/// The names and forms of the topics.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct TopicSettings {
    /// The namespace of all topics but `/tf`, such as `/v101`.
    pub namespace: String,
    /// Whether `cmd_vel` is a TwistStamped. Otherwise it is a Twist.
    pub is_stamped: bool,
    /// Whether to publish the pose in `/tf`, too.
    pub publishes_transform: bool,
    /// The names of the frames.
    pub frames: Frames,
}

impl TopicSettings {
    /// Topics in a namespace, without `/tf`, and `cmd_vel` as Twist.
    #[must_use]
    pub fn new(namespace: impl Into<String>) -> Self {
        Self {
            namespace: namespace.into(),
            is_stamped: false,
            publishes_transform: false,
            frames: Frames::default(),
        }
    }
}

/// The topics.
pub(super) struct Topics {
    ros: Ros,
    node: Node,
    settings: TopicSettings,
    types: Arc<Types>,
    odometry: Lazy,
    pose: Lazy,
    twist: Lazy,
    fix: Lazy,
    status: Lazy,
    transform: Lazy,
    reports: Option<ReportTopics>,
}

/// A publisher that is created with its first message, so that a topic exists only if the vehicle has
/// something to publish.
#[derive(Default)]
struct Lazy(Option<Publisher>);

impl Lazy {
    fn publish(
        &mut self,
        node: &Node,
        topic: &str,
        message: Result<Message, ValueError>,
    ) -> Result<(), SessionError> {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                tracing::debug!(topic, %error, "no message");
                return Ok(());
            }
        };
        let publisher = match self.0.take() {
            Some(publisher) => publisher,
            None => node.publisher(topic, message.interface(), Qos::default())?,
        };
        self.0.insert(publisher).publish(&message)
    }
}

impl Topics {
    pub(super) fn new(
        ros: Ros,
        node: Node,
        settings: TopicSettings,
        types: Arc<Types>,
        reports: Option<ReportTopics>,
    ) -> Self {
        Self {
            ros,
            node,
            settings,
            types,
            odometry: Lazy::default(),
            pose: Lazy::default(),
            twist: Lazy::default(),
            fix: Lazy::default(),
            status: Lazy::default(),
            transform: Lazy::default(),
            reports,
        }
    }

    /// Starts the subscriptions, which end when the returned set is dropped. They send what they
    /// receive to `inputs`.
    pub(super) fn subscribe(
        &self,
        inputs: &mpsc::Sender<Input>,
    ) -> Result<JoinSet<()>, SessionError> {
        let mut tasks = JoinSet::new();
        let (twist, path) = match self.settings.is_stamped {
            true => (&self.types.stamped_twist, "twist."),
            false => (&self.types.twist, ""),
        };
        let cmd_vel = self.subscription("cmd_vel", twist)?;
        tasks.spawn(forward(cmd_vel, inputs.clone(), move |received| {
            let publisher = received.attachment.gid;
            let twist = read_twist(&received.message, path).ok()?;
            Some(Input::Twist { publisher, twist })
        }));
        let goal = self.subscription("goal_pose", &self.types.pose)?;
        tasks.spawn(forward(goal, inputs.clone(), |received| {
            Some(Input::Goal(read_goal(&received.message).ok()?))
        }));
        let stop = self.subscription("emergency_stop", &self.types.bool)?;
        tasks.spawn(forward(stop, inputs.clone(), |received| {
            let on = received.message.get("data").ok()?.as_bool()?;
            Some(Input::EmergencyStop(on))
        }));
        let release = self.subscription("release", &self.types.empty)?;
        tasks.spawn(forward(release, inputs.clone(), |_| Some(Input::Release)));
        tasks.spawn(watch(
            self.ros.clone(),
            self.topic("cmd_vel"),
            inputs.clone(),
        ));
        Ok(tasks)
    }

    fn subscription(
        &self,
        name: &str,
        interface: &Arc<Interface>,
    ) -> Result<Subscription, SessionError> {
        self.node
            .subscription(&self.topic(name), interface, Qos::default())
    }

    fn topic(&self, name: &str) -> String {
        format!("{}/{name}", self.settings.namespace)
    }

    /// Publishes what the vehicle's side puts out, until it ends.
    pub(super) async fn publish_all(
        mut self,
        mut outputs: mpsc::Receiver<Output>,
    ) -> Result<(), SessionError> {
        while let Some(output) = outputs.recv().await {
            self.publish(output)?;
        }
        Ok(())
    }

    fn publish(&mut self, output: Output) -> Result<(), SessionError> {
        let frames = &self.settings.frames;
        let types = self.types.clone();
        let (lazy, name, message) = match output {
            Output::Pose(pose) => {
                self.publish_transform(&pose)?;
                let message = types.pose(&pose, &self.settings.frames);
                (&mut self.pose, "pose", message)
            }
            Output::Odometry(odometry) => {
                let message = types.odometry(&odometry, frames);
                (&mut self.odometry, "odom", message)
            }
            Output::Twist(twist) => (&mut self.twist, "velocity", types.twist(&twist, frames)),
            Output::Fix(fix) => (&mut self.fix, "fix", types.fix(&fix, frames)),
            Output::Status { stamp, diagnostics } => {
                let message = types.status(stamp, &diagnostics);
                (&mut self.status, "status", message)
            }
            Output::Report {
                source,
                definition,
                octets,
            } => {
                if let Some(reports) = &mut self.reports {
                    let namespace = &self.settings.namespace;
                    reports.publish(&self.node, namespace, source, &definition, &octets);
                }
                return Ok(());
            }
        };
        let topic = format!("{}/{name}", self.settings.namespace);
        lazy.publish(&self.node, &topic, message)
    }

    fn publish_transform(&mut self, pose: &PoseSample) -> Result<(), SessionError> {
        if !self.settings.publishes_transform {
            return Ok(());
        }
        let message = self.types.transform(pose, &self.settings.frames);
        self.transform.publish(&self.node, "/tf", message)
    }
}

/// Sends the messages of a subscription as inputs, until the bridge ends.
async fn forward(
    mut subscription: Subscription,
    inputs: mpsc::Sender<Input>,
    read: impl Fn(&Received) -> Option<Input>,
) {
    let mut malformed = 0;
    loop {
        let received = subscription.receive().await;
        let counted = subscription.counters().malformed;
        if counted > std::mem::replace(&mut malformed, counted)
            && inputs.send(Input::Undecoded).await.is_err()
        {
            return;
        }
        let input = read(&received).unwrap_or(Input::Undecoded);
        if inputs.send(input).await.is_err() {
            return;
        }
    }
}

/// Reports publishers of `cmd_vel` that are gone, and the loss of the network.
async fn watch(ros: Ros, topic: String, inputs: mpsc::Sender<Input>) {
    let mut changes = ros.changes();
    let mut known: BTreeSet<Gid> = BTreeSet::new();
    let mut was_connected = false;
    loop {
        changes.borrow_and_update();
        let is_connected = ros.is_connected();
        let is_lost = std::mem::replace(&mut was_connected, is_connected) && !is_connected;
        if is_lost && inputs.send(Input::Disconnected).await.is_err() {
            return;
        }
        let publishers = ros.publishers(&topic);
        let present = publishers.iter().map(crate::graph::Token::gid).collect();
        let before = std::mem::replace(&mut known, present);
        for gone in before.difference(&known) {
            if inputs.send(Input::PublisherGone(*gone)).await.is_err() {
                return;
            }
        }
        if changes.changed().await.is_err() {
            return;
        }
    }
}
