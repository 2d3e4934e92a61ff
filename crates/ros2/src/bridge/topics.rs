//! The ROS side: the topics of a vehicle, as publishers and subscriptions of one node.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::interval;

use super::messages::{Frames, Types, read_goal, read_twist};
use super::ports::{Command, Input, Output};
use super::report_topics::ReportTopics;
use super::samples::PoseSample;
use crate::graph::{Endpoint, Entity, EntityKind, Gid, Qos};
use crate::interface::{Interface, shown};
use crate::message::{Message, ValueError};
use crate::session::{
    Node, Publisher, Received, Ros, SessionError, Subscription, SubscriptionCounters,
};

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
        let cmd_vel = self.incoming("cmd_vel", twist, inputs)?;
        tasks.spawn(cmd_vel.forward(move |received, session| {
            // The stamp of a TwistStamped is not checked: with simulated time, it runs at another
            // rate than the clock of the bridge.
            Some(Input::Twist(Command {
                publisher: received.attachment.gid,
                session,
                sequence: received.attachment.sequence,
                stamp: received.attachment.stamp,
                arrival: received.arrival,
                twist: read_twist(&received.message, path).ok()?,
            }))
        }));
        let goal = self.incoming("goal_pose", &self.types.pose, inputs)?;
        tasks.spawn(goal.forward(|received, _| {
            let pose = read_goal(&received.message).ok()?;
            Some(Input::Goal(received.attachment.gid, pose))
        }));
        let stop = self.incoming("emergency_stop", &self.types.bool, inputs)?;
        tasks.spawn(stop.forward(|received, _| {
            let on = received.message.get("data").ok()?.as_bool()?;
            Some(Input::EmergencyStop(received.attachment.gid, on))
        }));
        let release = self.incoming("release", &self.types.empty, inputs)?;
        tasks.spawn(release.forward(|received, _| Some(Input::Release(received.attachment.gid))));
        let watch = Watch {
            ros: self.ros.clone(),
            topic: self.topic("cmd_vel"),
            interface: twist.clone(),
            inputs: inputs.clone(),
        };
        tasks.spawn(watch.run());
        Ok(tasks)
    }

    fn incoming(
        &self,
        name: &str,
        interface: &Arc<Interface>,
        inputs: &mpsc::Sender<Input>,
    ) -> Result<Incoming, SessionError> {
        let topic = self.topic(name);
        let subscription = self.node.subscription(&topic, interface, Qos::default())?;
        Ok(Incoming {
            ros: self.ros.clone(),
            topic,
            subscription,
            inputs: inputs.clone(),
        })
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

impl Drop for Topics {
    fn drop(&mut self) {
        let all = [
            &self.odometry,
            &self.pose,
            &self.twist,
            &self.fix,
            &self.status,
            &self.transform,
        ];
        let publishers = all.iter().filter_map(|lazy| lazy.0.as_ref());
        let dropped: u64 = publishers.map(Publisher::dropped).sum();
        if dropped > 0 {
            tracing::info!("{dropped} messages dropped because a link to ROS was congested");
        }
    }
}

/// How often the messages that a subscription has lost are counted.
const LOOK: Duration = Duration::from_secs(1);

/// A topic by which ROS commands the vehicle.
struct Incoming {
    ros: Ros,
    topic: String,
    subscription: Subscription,
    inputs: mpsc::Sender<Input>,
}

impl Incoming {
    /// Sends the messages as inputs, until the bridge ends. `read` gets the session of the publisher, too.
    async fn forward(mut self, read: impl Fn(&Received, Gid) -> Option<Input>) {
        let mut counted = SubscriptionCounters::default();
        let mut look = interval(LOOK);
        loop {
            let input = tokio::select! {
                received = self.subscription.receive() => self.input(&received, &read),
                _ = look.tick() => match lost(&mut counted, self.subscription.counters()) {
                    Some(input) => input,
                    None => continue,
                },
            };
            if self.inputs.send(input).await.is_err() {
                return;
            }
        }
    }

    /// A message counts only if its publisher has declared its token: an invented gid speaks for nobody.
    fn input(&self, received: &Received, read: impl Fn(&Received, Gid) -> Option<Input>) -> Input {
        let gid = received.attachment.gid;
        let Some(publisher) = self.ros.publisher(&self.topic, gid) else {
            return Input::Unannounced(gid);
        };
        let session = Gid::of_token(&publisher.token.session);
        read(received, session).unwrap_or(Input::Lost {
            malformed: 1,
            dropped: 0,
        })
    }
}

/// What was lost since the counters were read before.
fn lost(counted: &mut SubscriptionCounters, now: SubscriptionCounters) -> Option<Input> {
    let before = std::mem::replace(counted, now);
    (before != now).then(|| Input::Lost {
        malformed: now.malformed - before.malformed,
        dropped: now.dropped - before.dropped,
    })
}

/// Reports publishers of `cmd_vel` that are gone, and the loss of the network.
struct Watch {
    ros: Ros,
    topic: String,
    interface: Arc<Interface>,
    inputs: mpsc::Sender<Input>,
}

impl Watch {
    async fn run(self) {
        let mut changes = self.ros.changes();
        let mut known: BTreeSet<Gid> = BTreeSet::new();
        let mut was_connected = false;
        let mut has_warned = false;
        loop {
            changes.borrow_and_update();
            let is_connected = self.ros.is_connected();
            let is_lost = std::mem::replace(&mut was_connected, is_connected) && !is_connected;
            if is_lost && self.inputs.send(Input::Disconnected).await.is_err() {
                return;
            }
            let mut mismatch = None;
            let gid = |entity: &Entity| {
                let endpoint = entity.token.endpoint.as_ref();
                mismatch = mismatch
                    .take()
                    .or_else(|| endpoint.and_then(|it| mismatch_of(it, &self.interface)));
                entity.gid
            };
            let present = self.ros.others(EntityKind::Publisher, &self.topic, gid);
            if let Some(mismatch) = mismatch
                && !std::mem::replace(&mut has_warned, true)
            {
                tracing::warn!("a publisher of {} is not heard: {mismatch}", self.topic);
            }
            let before = std::mem::replace(&mut known, present);
            for gone in before.difference(&known) {
                let gone = Input::PublisherGone(*gone);
                if self.inputs.send(gone).await.is_err() {
                    return;
                }
            }
            if changes.changed().await.is_err() {
                return;
            }
        }
    }
}

/// Why the messages of a publisher do not arrive, and the remedy; `None` if they do.
fn mismatch_of(publisher: &Endpoint, ours: &Interface) -> Option<String> {
    let name = ours.name();
    if publisher.type_name != name.dds() {
        let theirs = shown(&publisher.type_name);
        let remedy = match name.name() {
            "Twist" => "use --stamped for TwistStamped",
            _ => "do not use --stamped for Twist",
        };
        return Some(format!(
            "it has the type {theirs} instead of {name}: {remedy}"
        ));
    }
    let is_same = publisher.type_hash == ours.hash();
    (!is_same).then(|| {
        let theirs = shown(&publisher.type_hash);
        format!("its {name} has the hash {theirs}: use the definition of ROS 2 Jazzy or newer")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_publisher_of_another_type_is_reported_with_the_remedy_in_printable_characters() {
        let types = Types::bundled().unwrap();
        let topic = "/v101/cmd_vel".parse().unwrap();
        let publisher = |interface| Endpoint::new(&topic, interface, Qos::default());
        let stamped = publisher(&types.stamped_twist);
        let why = mismatch_of(&stamped, &types.twist).unwrap();
        assert!(why.contains("TwistStamped"), "{why}");
        assert!(why.contains("use --stamped"), "{why}");
        let mut plain = publisher(&types.twist);
        assert_eq!(mismatch_of(&plain, &types.twist), None);
        let why = mismatch_of(&plain, &types.stamped_twist).unwrap();
        assert!(why.contains("do not use --stamped"), "{why}");
        plain.type_hash = "TypeHashNotSupported".to_owned();
        let why = mismatch_of(&plain, &types.twist).unwrap();
        assert!(why.contains("hash TypeHashNotSupported"), "{why}");
        let hostile = "\u{1b}[2J\n".repeat(1000);
        plain.type_hash.clone_from(&hostile);
        let of_hash = mismatch_of(&plain, &types.twist).unwrap();
        plain.type_name = hostile;
        let of_name = mismatch_of(&plain, &types.twist).unwrap();
        for why in [of_hash, of_name] {
            assert!(why.len() < 500, "{why}");
            assert!(!why.contains(char::is_control), "{why:?}");
        }
    }

    #[test]
    fn lost_messages_are_counted_once() {
        let mut counted = SubscriptionCounters::default();
        assert_eq!(lost(&mut counted, SubscriptionCounters::default()), None);
        let now = SubscriptionCounters {
            dropped: 2,
            malformed: 3,
        };
        let input = Input::Lost {
            malformed: 3,
            dropped: 2,
        };
        assert_eq!(lost(&mut counted, now), Some(input));
        assert_eq!(lost(&mut counted, now), None);
    }
}
