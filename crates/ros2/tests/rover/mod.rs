//! A vehicle of real parts and an operator, each on its own node on loopback.

use std::convert::Infallible;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::messages::core::QueryControl;
use jaus::messages::mobility::QueryVelocityState;
use jaus::node::{Config, Node, now};
use jaus::service::TimeOfDay;
use jaus_test_kit::group::own_group;
use jaus_vehicle::parts::{
    KnowledgeStore, Part, PartError, PathDriver, Planner, PoseSensor, PrimitiveDriver, Slot,
    VectorDriver, VelocitySensor,
};
use tokio::task::JoinHandle;

pub(crate) const PRIMITIVE: JausId = JausId::new(101, 33, 33);
const PLANNER: JausId = JausId::new(101, 36, 36);
const POSE: JausId = JausId::new(101, 41, 41);
const VELOCITY: JausId = JausId::new(101, 42, 42);
const VECTOR: JausId = JausId::new(101, 44, 44);
const PATH: JausId = JausId::new(101, 48, 48);
const STORE: JausId = JausId::new(101, 61, 61);

/// A vehicle and an operator of JAUS.
pub(crate) struct Rover {
    pub(crate) group: Group,
    pub(crate) time: TimeOfDay,
    pub(crate) operator: Component,
    nodes: Vec<Node>,
    pub(crate) tasks: Vec<JoinHandle<()>>,
    folder: tempfile::TempDir,
}

impl Rover {
    /// No part runs yet. The time of day is `begin`, and goes on with the clock of tokio.
    pub(crate) fn new(begin: Duration) -> Self {
        let group = own_group();
        let node = Node::start(Config::loopback(60, 1).group(group)).unwrap();
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        let start = now();
        Self {
            group,
            time: TimeOfDay::new(move || begin + (now() - start)),
            operator: operator.attach(&node, 1).unwrap(),
            nodes: vec![node],
            tasks: Vec::new(),
            folder: tempfile::tempdir().unwrap(),
        }
    }

    pub(crate) fn node(&mut self, id: JausId) -> Node {
        let config = Config::loopback(id.subsystem(), id.node()).group(self.group);
        let node = Node::start(config).unwrap();
        self.nodes.push(node.clone());
        node
    }

    fn part<F>(&mut self, id: JausId, run: impl FnOnce(Slot) -> F)
    where
        F: Future<Output = Result<Infallible, PartError>> + Send + 'static,
    {
        let node = self.node(id);
        let port = node.attach(id.component()).unwrap();
        let part = run(Slot {
            time: self.time.clone(),
            ..Slot::new(port, node, Kind::Vehicle, "Rover")
        });
        self.tasks.push(tokio::spawn(async move {
            let Err(error) = part.await;
            panic!("{id} cannot go on: {error}");
        }));
    }

    /// Starts what a vehicle needs to be driven by hand.
    pub(crate) fn start_vehicle(&mut self) {
        self.start_driver();
        self.start_sensors();
    }

    pub(crate) fn start_driver(&mut self) {
        self.part(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
    }

    pub(crate) fn start_sensors(&mut self) {
        self.part(VELOCITY, |slot| VelocitySensor::default().run(slot));
        self.part(POSE, |slot| PoseSensor::default().run(slot));
    }

    /// Starts what it needs besides to drive to goals.
    pub(crate) fn start_planner(&mut self) {
        let store = KnowledgeStore {
            file: self.folder.path().join(KnowledgeStore::FILE),
            map: Some(KnowledgeStore::demo_map()),
            ..KnowledgeStore::default()
        };
        self.part(STORE, |slot| store.run(slot));
        self.part(VECTOR, |slot| VectorDriver::default().run(slot));
        self.part(PATH, |slot| PathDriver::default().run(slot));
        self.part(PLANNER, |slot| Planner::default().run(slot));
    }

    /// The subsystem that controls the primitive driver; 0 for none.
    pub(crate) async fn controller(&self) -> u16 {
        let asked = self.operator.query(PRIMITIVE, &QueryControl {}).await;
        asked.unwrap().subsystem_id
    }

    /// Forward, in m/s, as the vehicle reports it.
    pub(crate) async fn reported_speed(&self) -> f64 {
        let query = QueryVelocityState::all();
        let report = self.operator.query(VELOCITY, &query).await.unwrap();
        report.velocity_x_m_per_s().unwrap_or_default()
    }

    pub(crate) async fn end(self) {
        for task in self.tasks {
            task.abort();
            let _ = task.await;
        }
        drop(self.operator);
        for node in self.nodes {
            node.shutdown().await;
        }
    }
}
