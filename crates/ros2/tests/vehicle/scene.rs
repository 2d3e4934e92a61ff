//! A vehicle of real parts and the JAUS side of a bridge, each on its own node on loopback, in virtual
//! time.

use std::convert::Infallible;
use std::panic::Location;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::messages::core::QueryControl;
use jaus::node::{Config, Node, now};
use jaus::service::TimeOfDay;
use jaus_ros2::Gid;
use jaus_ros2::bridge::samples::OdometrySample;
use jaus_ros2::bridge::vehicle::Selection;
use jaus_ros2::bridge::velocity::Twist;
use jaus_ros2::bridge::{Input, Output, Reports, Settings, run};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::LIMIT;
use jaus_vehicle::parts::{
    KnowledgeStore, Part, PartError, PathDriver, Planner, PoseSensor, PrimitiveDriver, Slot,
    VectorDriver, VelocitySensor,
};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

pub(crate) const PRIMITIVE: JausId = JausId::new(101, 33, 33);
const PLANNER: JausId = JausId::new(101, 36, 36);
const POSE: JausId = JausId::new(101, 41, 41);
const VELOCITY: JausId = JausId::new(101, 42, 42);
const VECTOR: JausId = JausId::new(101, 44, 44);
const PATH: JausId = JausId::new(101, 48, 48);
const STORE: JausId = JausId::new(101, 61, 61);

/// Time of day at the beginning of a test, since the beginning of 1970.
const BEGIN: Duration = Duration::from_secs(1_700_000_000);

pub(crate) const PUBLISHER: Gid = Gid([7; 16]);

/// A network with a vehicle, a bridge, and an operator of JAUS.
pub(crate) struct Scene {
    group: Group,
    /// The time of day, in virtual time.
    time: TimeOfDay,
    pub(crate) operator: Component,
    nodes: Vec<Node>,
    parts: Vec<JoinHandle<()>>,
    inputs: Option<mpsc::Sender<Input>>,
    seen: Arc<Mutex<Seen>>,
    folder: tempfile::TempDir,
}

/// The last outputs of the bridge.
#[derive(Default)]
struct Seen {
    odometry: Option<OdometrySample>,
    /// The messages of all states, one a line.
    status: String,
}

impl Scene {
    pub(crate) fn new() -> Self {
        let group = own_group();
        let node = Node::start(Config::loopback(60, 1).group(group)).unwrap();
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        let begin = now();
        Self {
            group,
            time: TimeOfDay::new(move || BEGIN + (now() - begin)),
            operator: operator.attach(&node, 1).unwrap(),
            nodes: vec![node],
            parts: Vec::new(),
            inputs: None,
            seen: Arc::default(),
            folder: tempfile::tempdir().unwrap(),
        }
    }

    fn node(&mut self, id: JausId) -> Node {
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
        self.parts.push(tokio::spawn(async move {
            let Err(error) = part.await;
            panic!("{id} cannot go on: {error}");
        }));
    }

    /// Starts what a vehicle needs to be driven by hand.
    pub(crate) fn start_vehicle(&mut self) {
        self.part(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
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

    /// Starts a bridge with this authority.
    pub(crate) fn start_bridge(&mut self, authority: Option<u8>) {
        let mut settings = Settings::new(Selection {
            subsystem: 101,
            only: Vec::new(),
        });
        settings.control = authority;
        settings.allow_clear = true;
        settings.rate_hz = 20.0;
        let node = self.node(JausId::new(101, 252, 1));
        let bridge = Component::builder(Kind::Vehicle, "Rover").attach(&node, 1);
        let (inputs, received) = mpsc::channel(64);
        let (outputs, mut published) = mpsc::channel(256);
        let seen = self.seen.clone();
        self.inputs = Some(inputs);
        self.parts.push(tokio::spawn(async move {
            while let Some(output) = published.recv().await {
                seen.lock().unwrap().note(output);
            }
        }));
        let bridge = bridge.unwrap();
        let time = self.time.clone();
        self.parts.push(tokio::spawn(async move {
            run(bridge, time, settings, Reports::none(), received, outputs).await;
        }));
    }

    pub(crate) async fn input(&self, input: Input) {
        let inputs = self.inputs.as_ref().unwrap();
        assert!(inputs.send(input).await.is_ok(), "the bridge has ended");
    }

    /// Publishes a velocity.
    pub(crate) async fn drive(&self, forward: f64, yaw_rate: f64) {
        let twist = Twist {
            linear: [forward, 0.0, 0.0],
            angular: [0.0, 0.0, yaw_rate],
        };
        let publisher = PUBLISHER;
        self.input(Input::Twist { publisher, twist }).await;
    }

    /// The last odometry.
    pub(crate) fn odometry(&self) -> Option<OdometrySample> {
        self.seen.lock().unwrap().odometry
    }

    /// The speed that ROS sees; 0 before the first odometry.
    pub(crate) fn speed(&self) -> f64 {
        self.odometry().map_or(0.0, |it| it.twist.linear[0])
    }

    /// Publishes a velocity at 10 Hz until something holds.
    #[track_caller]
    pub(crate) fn drive_until(
        &self,
        forward: f64,
        holds: impl Fn(&Self) -> bool,
    ) -> impl Future<Output = ()> {
        self.repeat(holds, async move || self.drive(forward, 0.0).await)
    }

    /// Waits until something holds.
    #[track_caller]
    pub(crate) fn until(&self, holds: impl Fn(&Self) -> bool) -> impl Future<Output = ()> {
        self.repeat(holds, async || {})
    }

    /// Repeats an act at 10 Hz until something holds; fails with the status.
    #[track_caller]
    fn repeat(
        &self,
        holds: impl Fn(&Self) -> bool,
        act: impl AsyncFn(),
    ) -> impl Future<Output = ()> {
        let place = Location::caller();
        async move {
            let end = now() + LIMIT;
            while !holds(self) {
                assert!(
                    now() < end,
                    "not within {LIMIT:?}, at {place}: {}",
                    self.status()
                );
                act().await;
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
        }
    }

    /// Whether the status says this.
    pub(crate) fn says(&self, text: &str) -> bool {
        self.seen.lock().unwrap().status.contains(text)
    }

    pub(crate) fn status(&self) -> String {
        self.seen.lock().unwrap().status.clone()
    }

    /// The subsystem that controls the primitive driver; 0 for none.
    pub(crate) async fn controller(&self) -> u16 {
        let asked = self.operator.query(PRIMITIVE, &QueryControl {}).await;
        asked.unwrap().subsystem_id
    }

    pub(crate) async fn end(self) {
        for part in self.parts {
            part.abort();
            let _ = part.await;
        }
        drop(self.operator);
        for node in self.nodes {
            node.shutdown().await;
        }
    }
}

impl Seen {
    fn note(&mut self, output: Output) {
        match output {
            Output::Odometry(odometry) => self.odometry = Some(odometry),
            Output::Status { diagnostics, .. } => {
                let lines = diagnostics.iter().map(|it| {
                    let values = it
                        .values
                        .iter()
                        .map(|(name, value)| format!("{name}={value}"));
                    let values: Vec<_> = values.collect();
                    format!("{}: {}; {}", it.name, it.message, values.join(", "))
                });
                self.status = lines.collect::<Vec<_>>().join("\n");
            }
            _ => {}
        }
    }
}
