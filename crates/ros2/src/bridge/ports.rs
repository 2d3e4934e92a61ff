//! The messages between the vehicle's side of the bridge and the ROS side.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;

use super::definition::Definition;
use super::diagnostics::Diagnostic;
use super::frames::Quaternion;
use super::samples::{FixSample, OdometrySample, PoseSample, TwistSample};
use super::velocity::Twist;
use crate::graph::Gid;

/// What arrives from ROS, with its publisher.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A `cmd_vel`.
    Twist(Command),
    /// A `goal_pose`.
    Goal(Gid, GoalPose),
    /// An `emergency_stop`: whether to set it or to clear it.
    EmergencyStop(Gid, bool),
    /// A `release`: give up control and cancel the goal.
    Release(Gid),
    /// A message whose publisher has no liveliness token on its topic: its gid is made up.
    Unannounced(Gid),
    /// A publisher of `cmd_vel` is gone.
    PublisherGone(Gid),
    /// Messages were lost on the ROS side.
    Lost {
        /// How many could not be read.
        malformed: u64,
        /// How many were not taken in time.
        dropped: u64,
    },
    /// The ROS network was lost: no publisher can be heard.
    Disconnected,
}

/// A `cmd_vel` with what rmw_zenoh attaches to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// The publisher.
    pub publisher: Gid,
    /// The session of the publisher: the hash of the id that its token states.
    pub session: Gid,
    /// The number of the message among those of its publisher.
    pub sequence: i64,
    /// When it was sent, in nanoseconds by the clock of the sender.
    pub stamp: i64,
    /// When the session received it.
    pub arrival: Instant,
    /// The velocity.
    pub twist: Twist,
}

/// A geometry_msgs/PoseStamped.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalPose {
    /// The frame of the pose.
    pub frame: String,
    /// Metres along its axes.
    pub position: [f64; 3],
    /// The orientation of `base_link` at the goal.
    pub orientation: Quaternion,
}

/// What goes to ROS.
#[derive(Debug, Clone, PartialEq)]
pub enum Output {
    /// The pose in `map`.
    Pose(PoseSample),
    /// Pose and velocity.
    Odometry(OdometrySample),
    /// The velocity.
    Twist(TwistSample),
    /// The position on the globe.
    Fix(FixSample),
    /// The states of the vehicle and the bridge.
    Status {
        /// The time, since the beginning of 1970 (UTC).
        stamp: Duration,
        /// The states.
        diagnostics: Vec<Diagnostic>,
    },
    /// Any report, as octets from its message code.
    Report {
        /// The component that sent it.
        source: JausId,
        /// The definition of the report.
        definition: Definition,
        /// The report.
        octets: Bytes,
    },
}
