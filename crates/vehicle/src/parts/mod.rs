//! Complete components of a ground vehicle, for the programs `jaus-…` and for systems in a single
//! process.
//!
//! A [`Part`] is a plain settings struct with sensible defaults. Given a [`Slot`] on a node, it
//! runs until it is dropped. Parts find each other by discovery alone, in any start order, and
//! continue when another one restarts.

mod communicator;
mod drivers;
mod global_driver;
mod global_pose_sensor;
mod hardware;
mod iio_device;
mod imu_sensor;
mod keeper;
mod knowledge_store;
mod navigation_inputs;
mod path_driver;
mod planner;
mod pose_file;
mod pose_sensor;
mod primitive_driver;
mod range_sensor;
mod stop_line;
mod telemetry;
pub mod tester;
mod turn_rates;
mod vector_driver;
mod velocity_sensor;

use std::convert::Infallible;
use std::future::Future;

use jaus::component::{self, AccessControl, Builder, Component, Kind};
use jaus::link::custom::CustomLink;
use jaus::node::{Node, Port, time_of_day};
use jaus::service::{Time, TimeOfDay};

use drivers::ChainGuard;

pub use communicator::Communicator;
pub use global_driver::GlobalDriver;
pub use global_pose_sensor::{GlobalPoseSensor, NavigationInputs};
#[cfg(all(feature = "can", target_os = "linux"))]
pub use hardware::CanMotors;
#[cfg(all(feature = "gpio", target_os = "linux"))]
pub use hardware::GpioMotors;
#[cfg(feature = "serial")]
pub use hardware::Sabertooth;
pub use hardware::{Drives, HBridgeMotors, Hardware, Motors, Servo, SteeringGear, Stop};
pub use iio_device::{IioDevice, Reading, Readings};
pub use imu_sensor::ImuSensor;
pub use knowledge_store::{Broken, KnowledgeStore};
pub use path_driver::PathDriver;
pub use planner::Planner;
pub use pose_sensor::PoseSensor;
pub use primitive_driver::PrimitiveDriver;
pub use range_sensor::RangeSensor;
pub use telemetry::{MissionCounts, Readout, Telemetry};
pub use turn_rates::Gyro;
pub use vector_driver::VectorDriver;
pub use velocity_sensor::VelocitySensor;

/// A complete component, configured but not yet running.
///
/// ```no_run
/// # use jaus::component::Kind;
/// # use jaus::node::{Config, Node};
/// # use jaus_vehicle::parts::{Part, Planner, Slot};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::new(101, 36))?;
/// let slot = Slot::new(node.attach(36)?, node, Kind::Vehicle, "Rover");
/// let error = match Planner::default().run(slot).await {
///     Ok(never) => match never {},
///     Err(error) => error,
/// };
/// eprintln!("the planner has stopped: {error}");
/// # Ok(())
/// # }
/// ```
pub trait Part: Send + 'static {
    /// The links that its node needs besides those of the node's settings. Called once, before the
    /// node starts; a part with links of its own cannot attach to the node of another process.
    fn links(&mut self) -> Vec<Box<dyn CustomLink>> {
        Vec::new()
    }

    /// Runs the component. Ends only when it cannot continue. Dropping the future stops the
    /// component.
    fn run(self, slot: Slot) -> impl Future<Output = Result<Infallible, PartError>> + Send;
}

/// A component's place on a node, and the identity of its subsystem.
#[derive(Debug)]
pub struct Slot {
    /// The port on the node.
    pub port: Port,
    /// The node, if it runs in the same process.
    pub node: Option<Node>,
    /// Kind of the subsystem.
    pub kind: Kind,
    /// Name of the subsystem.
    pub name: String,
    /// The clock for the time stamps of samples.
    pub time: TimeOfDay,
    /// Where the part shows its values to monitoring.
    pub telemetry: Telemetry,
}

impl Slot {
    /// A place on a node, `None` if the node runs in another process. Samples are stamped by the
    /// host's clock.
    pub fn new(
        port: Port,
        node: impl Into<Option<Node>>,
        kind: Kind,
        name: impl Into<String>,
    ) -> Self {
        Self {
            port,
            node: node.into(),
            kind,
            name: name.into(),
            time: TimeOfDay::new(time_of_day),
            telemetry: Telemetry::default(),
        }
    }

    /// Creates a builder for a component of this subsystem, to [start](Builder::live_on) on the
    /// slot's port.
    pub fn component(&self, name: &str) -> Builder {
        Component::builder(self.kind, self.name.clone()).component_name(name)
    }

    /// Like [`component`](Self::component), and the component offers the slot's time as a service.
    /// With that of a sensor, clients measure how old its samples are.
    fn timed_component(&self, name: &str) -> Builder {
        self.timed(self.component(name))
    }

    /// Like `timed_component`, with a guard that sees each message before the other services do.
    fn guarded_component(&self, name: &str, guard: ChainGuard) -> Builder {
        self.timed(self.component(name).offer(guard))
    }

    fn timed(&self, builder: Builder) -> Builder {
        builder
            .access_control(AccessControl::new())
            .offer(Time::new(self.time.clone()))
    }
}

/// Why a part cannot continue.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// The component cannot be attached.
    #[error(transparent)]
    Attach(#[from] component::AttachError),
    /// The client in control has shut it down (Management's Shutdown).
    #[error("shut down by the client in control")]
    ShutDown,
    /// The underlying node has stopped.
    #[error("the node has stopped")]
    NodeStopped,
    /// The component cannot publish its reports.
    #[error(transparent)]
    Publish(#[from] component::PublishError),
    /// A resource is missing or defective. The text contains the cause and a remedy, for the
    /// operator.
    #[error("{0}")]
    Broken(String),
}
