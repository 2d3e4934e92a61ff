//! A whole vehicle in one process and in virtual time: each part has its own node on loopback, so
//! that messages use the same transport as between boards.
//!
//! The clock of tokio is paused, and leaps to the next timer whenever there is nothing left to do. A
//! mission then takes as long as its computation, and no deadline is missed on a busy machine.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::node::{Config, Node, now};
use jaus::service::TimeOfDay;
use jaus_test_kit::group::own_group;
use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::{
    KnowledgeStore, Part, PathDriver, Planner, PoseSensor, PrimitiveDriver, Slot, SteeringGear,
    VectorDriver, VelocitySensor,
};
use tokio::task::JoinHandle;

/// Time of day at the beginning of a test, in seconds since the beginning of 1970.
const BEGIN: Duration = Duration::from_secs(1_700_000_000);

/// Interval between two looks at a condition. Without a pause virtual time would stand still.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// The running parts of a vehicle that a mission needs.
pub(super) struct WholeVehicle {
    subsystem: u16,
    group: Group,
    time: TimeOfDay,
    /// For the store's file.
    directory: Directory,
    /// The geometry of a vehicle with steered wheels.
    steering: Option<Ackermann>,
    running: BTreeMap<u8, (Node, JoinHandle<()>)>,
}

impl WholeVehicle {
    /// The parts by component number: primitive driver, planner, local pose sensor, velocity state
    /// sensor, vector driver, path segment driver, knowledge store.
    const PARTS: [u8; 7] = [33, 36, 41, 42, 44, 48, 61];

    /// Starts all parts, each as component C on node C of a subsystem. With `steering` the front
    /// wheels are steered; without, the vehicle turns on the spot.
    pub(super) fn start(subsystem: u16, steering: Option<Ackermann>) -> Self {
        let begin = now();
        let mut vehicle = Self {
            subsystem,
            group: own_group(),
            time: TimeOfDay::new(move || BEGIN + (now() - begin)),
            directory: Directory::new(subsystem),
            steering,
            running: BTreeMap::new(),
        };
        for number in Self::PARTS {
            vehicle.start_part(number);
        }
        vehicle
    }

    /// Starts a part, for example after [`kill`](Self::kill).
    pub(super) fn start_part(&mut self, number: u8) {
        let radius = self.steering.map_or(0.0, |it| it.turning_radius());
        match number {
            33 => {
                let gear = self.steering.map(SteeringGear::simulated);
                self.run(number, PrimitiveDriver::default().steering(gear));
            }
            36 => self.run(number, Planner::default().turning_radius(radius)),
            41 => self.run(number, PoseSensor::default()),
            42 => self.run(number, VelocitySensor::default()),
            44 => self.run(number, VectorDriver::default().turning_radius(radius)),
            48 => self.run(number, PathDriver::default().turning_radius(radius)),
            _ => {
                let store = KnowledgeStore {
                    file: self.directory.0.join(KnowledgeStore::FILE),
                    map: Some(KnowledgeStore::demo_map()),
                    ..KnowledgeStore::default()
                };
                self.run(number, store);
            }
        }
    }

    /// Runs a part as component `number` of the node with the same number.
    pub(super) fn run(&mut self, number: u8, part: impl Part) {
        let node = self.node(self.subsystem, number);
        let port = node.attach(number).unwrap();
        let slot = Slot {
            time: self.time.clone(),
            ..Slot::new(port, node.clone(), Kind::Vehicle, "Tested")
        };
        let task = tokio::spawn(async move {
            let Err(error) = part.run(slot).await;
            panic!("part {number} cannot go on: {error}");
        });
        self.running.insert(number, (node, task));
    }

    /// Ends a part immediately, as if its process were killed.
    pub(super) async fn kill(&mut self, number: u8) {
        let (node, task) = self.running.remove(&number).expect("it runs");
        task.abort();
        node.shutdown().await;
    }

    /// An operator's component on a node of the subsystem with the next number.
    pub(super) fn operator(&self) -> (Node, Component) {
        let desk = self.node(self.subsystem + 1, 1);
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        let operator = operator.attach(&desk, 1).unwrap();
        (desk, operator)
    }

    fn node(&self, subsystem: u16, number: u8) -> Node {
        Node::start(Config::loopback(subsystem, number).group(self.group)).unwrap()
    }

    /// Ends all parts, then their nodes.
    pub(super) async fn end(self) {
        for (_, task) in self.running.values() {
            task.abort();
        }
        for (node, _) in self.running.into_values() {
            node.shutdown().await;
        }
    }
}

/// A vehicle's own directory, removed when dropped.
struct Directory(PathBuf);

impl Directory {
    fn new(subsystem: u16) -> Self {
        let name = format!("jaus-mission-{subsystem}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
