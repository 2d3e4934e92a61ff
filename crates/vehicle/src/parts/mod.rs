//! Ready components of a ground vehicle: what the programs `jaus-…` run, and what a system in one
//! process is put together from.
//!
//! A [`Part`] is a set of plain settings with sensible defaults. Given a [`Slot`] on a node it runs
//! until it is dropped. Parts find each other by discovery alone, in any order of start, and go on
//! when another one is started again.

mod communicator;
mod drivers;
mod keeper;
mod knowledge_store;
mod path_driver;
mod planner;
mod pose_file;
mod pose_sensor;
mod primitive_driver;
mod stop_line;
pub mod tester;
mod vector_driver;
mod velocity_sensor;

use std::convert::Infallible;
use std::future::Future;
use std::time::{SystemTime, UNIX_EPOCH};

use jaus::component::{self, Builder, Component, Kind};
use jaus::node::{Node, Port};
use jaus::service::TimeOfDay;

pub use communicator::{Communicator, DEBUG_ADDRESS};
pub use knowledge_store::{Broken, KnowledgeStore};
pub use path_driver::PathDriver;
pub use planner::Planner;
pub use pose_sensor::PoseSensor;
#[cfg(all(feature = "gpio", target_os = "linux"))]
pub use primitive_driver::GpioMotors;
pub use primitive_driver::{Hardware, Motors, PrimitiveDriver, Stop};
pub use vector_driver::VectorDriver;
pub use velocity_sensor::VelocitySensor;

/// A ready component: what it is to do, not yet running.
pub trait Part: Send + 'static {
    /// Runs, and ends only when it can not go on. Dropping the future stops the component.
    fn run(self, slot: Slot) -> impl Future<Output = Result<Infallible, PartError>> + Send;
}

/// A component's place on a node, and what its subsystem is called.
#[derive(Debug)]
pub struct Slot {
    /// Its door to the node.
    pub port: Port,
    /// The node, if it is in the same process.
    pub node: Option<Node>,
    /// What the subsystem is.
    pub kind: Kind,
    /// What the subsystem is called.
    pub name: String,
}

impl Slot {
    /// A component of this subsystem, to be [started](Builder::live_on) on the slot's port.
    pub fn component(&self, name: &str) -> Builder {
        Component::builder(self.kind, self.name.clone()).component_name(name)
    }
}

/// Why a part can not go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// It can not be attached.
    #[error(transparent)]
    Attach(#[from] component::AttachError),
    /// The client in control has shut it down (Management's Shutdown).
    #[error("shut down by the client in control")]
    ShutDown,
    /// The node below it has stopped.
    #[error("the node has stopped")]
    NodeStopped,
    /// What it needs is not there, or is broken: what is wrong and what to do, for people.
    #[error("{0}")]
    Broken(String),
}

/// The host's clock, which stamps the samples of parts; 1970 on a computer whose clock is before that.
#[expect(
    clippy::disallowed_methods,
    reason = "parts run in real time, and their reports carry the time of day"
)]
fn host_clock() -> TimeOfDay {
    TimeOfDay::new(|| {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
        since_1970.unwrap_or_default()
    })
}
