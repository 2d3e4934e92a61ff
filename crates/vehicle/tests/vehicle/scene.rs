//! An operator, and parts of a vehicle that start and stop, each on its own node on loopback.
//!
//! Most tests run in virtual time: the clock of tokio is paused, and leaps to the next timer whenever
//! there is nothing left to do. A mission then takes as long as its computation, and no deadline is
//! missed on a busy machine. A loop that waits for something sleeps between two looks: without a
//! pause virtual time would stand still.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::future::Future;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Control, Kind, State};
use jaus::link::Group;
use jaus::messages::core::QueryStatus;
use jaus::node::{Config, Node, now};
use jaus::service::TimeOfDay;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{LIMIT, within_limit};
use jaus_vehicle::ground::StageReport;
use jaus_vehicle::messages::ground::{QueryStage, QueryWheelOdometry};
use jaus_vehicle::parts::{PartError, Slot};
use tokio::task::JoinHandle;

pub(crate) const PRIMITIVE: JausId = JausId::new(101, 33, 33);
pub(crate) const PLANNER: JausId = JausId::new(101, 36, 36);
pub(crate) const POSE: JausId = JausId::new(101, 41, 41);
pub(crate) const VELOCITY: JausId = JausId::new(101, 42, 42);
pub(crate) const VECTOR: JausId = JausId::new(101, 44, 44);
pub(crate) const PATH: JausId = JausId::new(101, 48, 48);
pub(crate) const STORE: JausId = JausId::new(101, 61, 61);

/// Time of day at the beginning of a test, since the beginning of 1970.
const BEGIN: Duration = Duration::from_secs(1_700_000_000);

/// A client, the multicast group that it shares with the parts, and the time of day.
pub(crate) struct Scene {
    pub(crate) group: Group,
    time: TimeOfDay,
    pub(crate) client: Component,
    _node: Node,
}

/// A part that runs until it is stopped.
pub(crate) struct Running(pub(crate) Node, pub(crate) JoinHandle<()>);

impl Running {
    pub(crate) async fn stop(self) {
        self.1.abort();
        let _ = self.1.await;
        self.0.shutdown().await;
    }
}

impl Scene {
    pub(crate) fn new() -> Self {
        let group = own_group();
        let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
        let client = Component::builder(Kind::OperatorControlUnit, "Operator");
        let begin = now();
        Self {
            group,
            time: TimeOfDay::new(move || BEGIN + (now() - begin)),
            client: client.attach(&node, 1).unwrap(),
            _node: node,
        }
    }

    pub(crate) fn start<F>(&self, id: JausId, run: impl FnOnce(Slot) -> F) -> Running
    where
        F: Future<Output = Result<std::convert::Infallible, PartError>> + Send + 'static,
    {
        let config = Config::loopback(id.subsystem(), id.node()).group(self.group);
        let node = Node::start(config).unwrap();
        let port = node.attach(id.component()).unwrap();
        let part = run(Slot {
            time: self.time.clone(),
            ..Slot::new(port, node.clone(), Kind::Vehicle, "Rover")
        });
        let task = tokio::spawn(async move {
            match part.await {
                Err(PartError::ShutDown) => {}
                Err(error) => panic!("{id} cannot go on: {error}"),
            }
        });
        Running(node, task)
    }

    /// Takes control and makes the component Ready.
    pub(crate) async fn control(&self, id: JausId, urn: &str) -> Control {
        self.until("control", || async {
            if self.client.find(urn).await.is_err() {
                return None;
            }
            let control = self.client.control(id, 200).await.ok()?;
            control.resume().await.ok()?;
            Some(control)
        })
        .await
    }

    pub(crate) async fn state(&self, id: JausId) -> Option<u8> {
        let report = self.client.query(id, &QueryStatus {}).await.ok()?;
        Some(report.status.0)
    }

    pub(crate) async fn stage(&self, id: JausId) -> Option<StageReport> {
        let report = self.client.query(id, &QueryStage {}).await.ok()?;
        Some(StageReport::from(&report))
    }

    pub(crate) async fn wheels(&self) -> (f64, f64) {
        let query = QueryWheelOdometry {};
        let report = self.client.query(PRIMITIVE, &query).await.unwrap();
        (report.left, report.right)
    }

    /// Waits until both wheels stand still. Returns their travel.
    pub(crate) async fn comes_to_rest(&self) -> (f64, f64) {
        let mut before = self.wheels().await;
        within_limit(async {
            loop {
                tokio::time::sleep(Duration::from_millis(300)).await;
                let now = self.wheels().await;
                if std::mem::replace(&mut before, now) == now {
                    return now;
                }
            }
        })
        .await
    }

    /// Repeats an attempt until it returns a value.
    pub(crate) async fn until<T, F: Future<Output = Option<T>>>(
        &self,
        what: &str,
        mut attempt: impl FnMut() -> F,
    ) -> T {
        let start = now();
        loop {
            if let Some(answer) = attempt().await {
                return answer;
            }
            assert!(now() - start < LIMIT, "{what}: in vain");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Repeats a command until a component is in a given state.
    pub(crate) async fn until_state(
        &self,
        id: JausId,
        state: State,
        control: &Control,
        command: &impl jaus::codec::Message,
    ) {
        self.until(&format!("{id} in {state}"), || async {
            let _ = control.send(command);
            (self.state(id).await == Some(state as u8)).then_some(())
        })
        .await;
    }
}
