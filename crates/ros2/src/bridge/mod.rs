//! The bridge: one vehicle, seen and commanded from ROS.
//!
//! * [`frames`], [`stamp`], [`samples`]: poses, velocities and positions in the frames of ROS.
//! * [`velocity`], [`drive`], [`goal`], [`emergency`]: what ROS commands, as state machines without
//!   I/O and without a clock.
//! * [`vehicle`], [`diagnostics`]: the vehicle as Discovery and its own reports describe it.
//! * [`run`]: the task that joins them with a JAUS component. It exchanges [`Input`]s and [`Output`]s
//!   with the ROS side, and knows neither CDR nor zenoh.
//! * [`Bridge`]: the same with the topics of ROS, as a component.

mod counters;
mod definition;
pub mod diagnostics;
pub mod drive;
pub mod emergency;
mod following;
pub mod frames;
pub mod goal;
mod jobs;
mod lease;
mod messages;
mod part;
mod ports;
mod publishers;
mod report;
mod report_topics;
mod reports;
mod rights;
mod runner;
pub mod samples;
mod sequence;
pub mod stamp;
mod topics;
pub mod vehicle;
pub mod velocity;

use jaus::component::Component;
use jaus::node::Recorder;
use jaus::rights::Rules;
use jaus::service::TimeOfDay;
use jaus_vehicle::parts::PartError;
use tokio::sync::mpsc;

pub use counters::{Counter, Counters};
pub use definition::Definition;
pub use messages::Frames;
pub use part::{Bridge, BridgeError};
pub use ports::{Command, GoalPose, Input, Output};
pub use publishers::Outdated;
pub use reports::{Reports, UnknownReport};
pub use topics::TopicSettings;

use drive::DriveSettings;
use vehicle::Selection;

use crate::graph::Gid;

/// The settings of the JAUS side.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// The components of the vehicle.
    pub vehicle: Selection,
    /// The rate of poses, velocities, positions and further reports, in hertz.
    pub rate_hz: f64,
    /// What ROS may do. Control is requested with the authority of `control`.
    pub rules: Rules,
    /// Times and limits of driving.
    pub drive: DriveSettings,
    /// The speed on the way to goals, in m/s.
    pub goal_speed: f64,
    /// The frame of poses and goals.
    pub map_frame: String,
}

impl Settings {
    /// Settings for a vehicle: ROS watches ([`Rules::watch`]), 10 Hz, goals at 1 m/s, in the frame `map`.
    #[must_use]
    pub fn new(vehicle: Selection) -> Self {
        Self {
            vehicle,
            rate_hz: 10.0,
            rules: Rules::watch(),
            drive: DriveSettings::default(),
            goal_speed: 1.0,
            map_frame: "map".to_owned(),
        }
    }
}

/// Runs the JAUS side until the component or the ROS side stops. Outputs that the ROS side does not
/// take in time are dropped and counted. `time` stamps what has no time stamp of its own. The recorder takes what
/// the publishers of ROS may and may not do, for an audit log.
pub async fn run(
    component: Component,
    time: TimeOfDay,
    settings: Settings,
    reports: Reports,
    recorder: Option<Recorder<Gid>>,
    ports: (mpsc::Receiver<Input>, mpsc::Sender<Output>),
) -> PartError {
    runner::Runner::new(component, time, settings, reports, recorder, ports)
        .run()
        .await
}
