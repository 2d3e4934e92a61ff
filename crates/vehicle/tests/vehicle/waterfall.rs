//! The chain of drivers as a whole. A client sends a path to the path segment driver, and the
//! vehicle reaches its end through all stages, even if any part restarts on the way. An emergency
//! at the last stage ends the motion permanently.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::future::Future;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::{FormattedBlob, Message};
use jaus::component::{Component, Control, Kind};
use jaus::link::Group;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{ConfirmElementRequest, SetElement};
use jaus::messages::mobility::{ExecuteList, QueryLocalPose, SetLocalPathSegment};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::LIMIT;
use jaus_vehicle::ground::{StageReport, StageState};
use jaus_vehicle::messages::ground::{QueryStage, QueryWheelOdometry};
use jaus_vehicle::parts::{
    Part, PathDriver, PoseSensor, PrimitiveDriver, Slot, VectorDriver, VelocitySensor,
};
use tokio::task::JoinHandle;

const PRIMITIVE: JausId = JausId::new(101, 33, 33);
const POSE: JausId = JausId::new(101, 41, 41);
const VELOCITY: JausId = JausId::new(101, 42, 42);
const VECTOR: JausId = JausId::new(101, 44, 44);
const PATH: JausId = JausId::new(101, 48, 48);
/// A vehicle of five parts, each on its own node, and a client.
struct Scene {
    group: Group,
    state: PathBuf,
    parts: Vec<(JausId, Node, JoinHandle<()>)>,
    client: Component,
    _desk: Node,
}

impl Scene {
    fn new(name: &str) -> Self {
        let group = own_group();
        let desk = Node::start(Config::loopback(42, 1).group(group)).unwrap();
        let client = Component::builder(Kind::OperatorControlUnit, "Operator");
        let state = std::env::temp_dir().join(format!("{name}-{}.toml", std::process::id()));
        let _ = std::fs::remove_file(&state);
        let mut scene = Self {
            group,
            state,
            parts: Vec::new(),
            client: client.attach(&desk, 1).unwrap(),
            _desk: desk,
        };
        // In this order no part finds its dependencies when it starts.
        for id in [PATH, VECTOR, POSE, VELOCITY, PRIMITIVE] {
            scene.start(id);
        }
        scene
    }

    fn start(&mut self, id: JausId) {
        match id {
            PRIMITIVE => self.run(id, PrimitiveDriver::default()),
            POSE => {
                let file = Some(self.state.clone());
                self.run(
                    id,
                    PoseSensor {
                        file,
                        ..PoseSensor::default()
                    },
                );
            }
            VELOCITY => self.run(id, VelocitySensor::default()),
            VECTOR => self.run(id, VectorDriver::default()),
            _ => self.run(id, PathDriver::default()),
        }
    }

    fn run(&mut self, id: JausId, part: impl Part) {
        let config = Config::loopback(id.subsystem(), id.node()).group(self.group);
        let node = Node::start(config).unwrap();
        let slot = Slot::new(
            node.attach(id.component()).unwrap(),
            node.clone(),
            Kind::Vehicle,
            "Rover",
        );
        let task = tokio::spawn(async move {
            let Err(error) = part.run(slot).await;
            panic!("{id} can not go on: {error}");
        });
        self.parts.push((id, node, task));
    }

    /// Aborts a part, shuts down its node, and starts it again.
    async fn restart(&mut self, id: JausId) {
        let place = self.parts.iter().position(|part| part.0 == id).unwrap();
        let (_, node, task) = self.parts.swap_remove(place);
        task.abort();
        let _ = task.await;
        node.shutdown().await;
        self.start(id);
    }

    async fn pose(&self) -> Option<(f64, f64)> {
        let query = QueryLocalPose::none().with_x().with_y();
        let report = self.client.query(POSE, &query).await.ok()?;
        report.x_m().zip(report.y_m())
    }

    async fn stage(&self, id: JausId) -> Option<StageReport> {
        let report = self.client.query(id, &QueryStage {}).await.ok()?;
        Some(StageReport::from(&report))
    }

    async fn travelled(&self) -> f64 {
        let query = QueryWheelOdometry {};
        let report = self.client.query(PRIMITIVE, &query).await.unwrap();
        report.left + report.right
    }

    /// Takes control of the path driver, and makes it drive in straight lines through these points.
    async fn drive(&self, points: &[(f64, f64)]) -> Control {
        let client = &self.client;
        client
            .find(jaus::messages::mobility::local_path_segment_driver::URN)
            .await
            .unwrap();
        let control = client.control(PATH, 200).await.unwrap();
        control.resume().await.unwrap();
        let last = points.len() as u16;
        let elements = points.iter().zip(1_u16..).map(|(&point, uid)| ElementRec {
            element_uid: uid,
            previous_uid: uid - 1,
            next_uid: if uid == last { 0 } else { uid + 1 },
            element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, segment(point)),
        });
        let request = SetElement {
            request_id_rec: RequestIdRec { request_id: 1 },
            element_list: elements.collect(),
        };
        let _: ConfirmElementRequest = client.request(PATH, &request).await.unwrap();
        let mut execute = ExecuteList {
            element_uid: Some(1),
            ..ExecuteList::default()
        };
        execute.set_speed_m_per_s(1.5).unwrap();
        control.deliver(&execute).await.unwrap();
        control
    }

    /// Waits until a condition holds. On timeout it panics with the pose and all stages.
    async fn until<F: Future<Output = bool>>(&self, what: &str, mut is_so: impl FnMut() -> F) {
        let start = Instant::now();
        while !is_so().await {
            if start.elapsed() > LIMIT {
                let mut told = format!("{what}: in vain; at {:?}", self.pose().await);
                for id in [PRIMITIVE, VECTOR, PATH] {
                    told += &format!("; {id} {:?}", self.stage(id).await);
                }
                panic!("{told}");
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    async fn until_at(&self, what: &str, is_there: impl Fn(f64, f64) -> bool) {
        let is_there = &is_there;
        self.until(what, || async move {
            self.pose().await.is_some_and(|(x, y)| is_there(x, y))
        })
        .await;
    }

    async fn until_stage(&self, id: JausId, state: StageState) -> StageReport {
        self.until(&format!("{id} {state}"), || async move {
            self.stage(id)
                .await
                .is_some_and(|stage| stage.state == state)
        })
        .await;
        self.stage(id).await.unwrap()
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.state);
    }
}

/// A straight line.
fn segment((x, y): (f64, f64)) -> bytes::Bytes {
    let mut line = SetLocalPathSegment::default();
    line.set_p1_x_m(x).unwrap();
    line.set_p1_y_m(y).unwrap();
    line.set_p2_x_m(x).unwrap();
    line.set_p2_y_m(y).unwrap();
    line.set_weighting_factor_value(0.0).unwrap();
    line.encode().unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_vehicle_gets_there_whichever_part_is_started_again() {
    let mut scene = Scene::new("waterfall-restarts");
    let control = scene.drive(&[(4.0, 0.0), (4.0, 4.0)]).await;
    scene.until_stage(PRIMITIVE, StageState::Active).await;
    scene.until_at("sets out", |x, _| x > 0.8).await;
    scene.restart(PRIMITIVE).await;
    scene
        .until_at("after the primitive driver", |x, _| x > 1.6)
        .await;
    scene.restart(VELOCITY).await;
    scene
        .until_at("after the velocity sensor", |x, _| x > 2.4)
        .await;
    let (before, _) = scene.pose().await.unwrap_or((2.4, 0.0));
    scene.restart(POSE).await;
    scene.until_at("after the pose sensor", |_, _| true).await;
    let (after, _) = scene.pose().await.unwrap();
    assert!(
        after > before - 0.1 && after < before + 1.5,
        "{before} m, then {after} m"
    );
    scene.until_at("on the second line", |_, y| y > 0.8).await;
    scene.restart(VECTOR).await;
    scene
        .until_at("after the vector driver", |_, y| y > 2.0)
        .await;
    scene.restart(PATH).await;
    control.release().await;
    // The client must repeat its command.
    let _control = scene.drive(&[(4.0, 4.0)]).await;
    let stage = scene.until_stage(PATH, StageState::Done).await;
    assert_eq!(stage.progress, 100);
    let (x, y) = scene.pose().await.unwrap();
    assert!((x - 4.0).hypot(y - 4.0) < 0.8, "at {x}, {y}");
    scene.until_stage(PRIMITIVE, StageState::Idle).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn after_an_emergency_at_the_last_stage_nothing_moves_by_itself() {
    let scene = Scene::new("waterfall-emergency");
    let control = scene.drive(&[(8.0, 0.0)]).await;
    scene.until_at("sets out", |x, _| x > 0.5).await;
    scene.client.set_emergency(PRIMITIVE).await.unwrap();
    let stage = scene.until_stage(PATH, StageState::Blocked).await;
    assert!(
        stage.stands_down() && stage.reason.contains("emergency"),
        "{stage:?}"
    );
    scene.client.clear_emergency(PRIMITIVE).await.unwrap();
    let before = scene.travelled().await;
    // Longer than any retry delay.
    tokio::time::sleep(Duration::from_secs(3)).await;
    let after = scene.travelled().await;
    assert!((after - before).abs() < 0.2, "{before} m, then {after} m");
    // After a new command it continues.
    scene.drive_again(&control).await;
    scene.until_at("goes on", |x, _| x > 2.0).await;
}

impl Scene {
    /// Makes the path driver execute its list again, from its first element.
    async fn drive_again(&self, control: &Control) {
        let mut execute = ExecuteList {
            element_uid: Some(1),
            ..ExecuteList::default()
        };
        execute.set_speed_m_per_s(1.5).unwrap();
        control.deliver(&execute).await.unwrap();
    }
}
