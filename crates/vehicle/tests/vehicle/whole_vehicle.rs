//! A whole vehicle in one process: each part has its own node on loopback, so that messages use the
//! same transport as between boards.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failure here fails the test"
)]

use std::collections::BTreeMap;
use std::ops::Deref;
use std::path::PathBuf;

use jaus::address::JausId;
use jaus::component::Control;
use jaus::messages::mobility::QueryLocalPose;
use jaus_vehicle::messages::ground::QueryPlannedPath;
use jaus_vehicle::mission::Settings;
use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::{
    KnowledgeStore, Part, PathDriver, Planner, PoseSensor, PrimitiveDriver, SteeringGear,
    VectorDriver, VelocitySensor,
};
use jaus_vehicle::zones::Point;

use crate::scene::{PATH, PLANNER, POSE, PRIMITIVE, Running, STORE, Scene, VECTOR, VELOCITY};

/// The running parts of a vehicle that a mission needs, and an operator.
pub(crate) struct WholeVehicle {
    pub(crate) scene: Scene,
    /// For the files of its parts.
    directory: Directory,
    /// The geometry of a vehicle with steered wheels.
    steering: Option<Ackermann>,
    /// How often the planner drives on by itself after a fault.
    retries: u8,
    running: BTreeMap<JausId, Running>,
}

impl Deref for WholeVehicle {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        &self.scene
    }
}

impl WholeVehicle {
    /// In this order no part finds its dependencies when it starts.
    const PARTS: [JausId; 7] = [PLANNER, PATH, VECTOR, STORE, POSE, VELOCITY, PRIMITIVE];

    /// Starts all parts. With `steering` the front wheels are steered; without, the vehicle turns
    /// on the spot.
    pub(crate) fn start(name: &str, steering: Option<Ackermann>) -> Self {
        Self::with_retries(name, steering, 0)
    }

    /// Like [`start`](Self::start), with a planner that drives on by itself so often after a fault.
    pub(crate) fn with_retries(name: &str, steering: Option<Ackermann>, retries: u8) -> Self {
        let mut vehicle = Self {
            scene: Scene::new(),
            directory: Directory::new(name),
            steering,
            retries,
            running: BTreeMap::new(),
        };
        for id in Self::PARTS {
            vehicle.start_part(id);
        }
        vehicle
    }

    /// Starts a part, for example after [`kill`](Self::kill).
    pub(crate) fn start_part(&mut self, id: JausId) {
        let radius = self.steering.map_or(0.0, |it| it.turning_radius());
        match id {
            PRIMITIVE => {
                let gear = self.steering.map(SteeringGear::simulated);
                self.run(id, PrimitiveDriver::default().steering(gear));
            }
            PLANNER => {
                let planner = Planner {
                    mission: Settings {
                        retries: self.retries,
                        ..Settings::default()
                    },
                    ..Planner::default()
                };
                self.run(id, planner.turning_radius(radius));
            }
            POSE => {
                let sensor = PoseSensor {
                    file: Some(self.directory.0.join("pose.toml")),
                    ..PoseSensor::default()
                };
                self.run(id, sensor);
            }
            VELOCITY => self.run(id, VelocitySensor::default()),
            VECTOR => self.run(id, VectorDriver::default().turning_radius(radius)),
            PATH => self.run(id, PathDriver::default().turning_radius(radius)),
            _ => {
                let store = KnowledgeStore {
                    file: self.directory.0.join(KnowledgeStore::FILE),
                    map: Some(KnowledgeStore::demo_map()),
                    ..KnowledgeStore::default()
                };
                self.run(id, store);
            }
        }
    }

    /// Runs a part of the vehicle.
    pub(crate) fn run(&mut self, id: JausId, part: impl Part) {
        let running = self.scene.start(id, |slot| part.run(slot));
        self.running.insert(id, running);
    }

    /// Ends a part immediately, as if its process were killed.
    pub(crate) async fn kill(&mut self, id: JausId) {
        self.running.remove(&id).expect("it runs").stop().await;
    }

    /// Ends a part immediately, and starts it again.
    pub(crate) async fn restart(&mut self, id: JausId) {
        self.kill(id).await;
        self.start_part(id);
    }

    /// Control of a component that can do without being resumed, for example of the store.
    pub(crate) async fn lease(&self, id: JausId) -> Control {
        let leased = || async { self.client.control(id, 150).await.ok() };
        self.until("control", leased).await
    }

    /// The vehicle's position, once it is known.
    pub(crate) async fn here(&self) -> Point {
        let query = QueryLocalPose::none().with_x().with_y();
        let asked = || async {
            let pose = self.client.query(POSE, &query).await.ok()?;
            pose.x_m().zip(pose.y_m())
        };
        self.until("a position", asked).await
    }

    /// The point of the planned path this far before its end, in metres.
    pub(crate) async fn planned(&self, distance: f64) -> Point {
        let path = self.client.query(PLANNER, &QueryPlannedPath {}).await;
        let path = path.unwrap();
        let [.., before, last] = path.point_list.as_slice() else {
            panic!("{path:?}");
        };
        let length = (last.x - before.x).hypot(last.y - before.y);
        let share = distance / length;
        (
            last.x + (before.x - last.x) * share,
            last.y + (before.y - last.y) * share,
        )
    }

    /// Waits until the vehicle is in a place that satisfies the condition.
    pub(crate) async fn until_at(&self, what: &str, is_there: impl Fn(f64, f64) -> bool) {
        let is_there = &is_there;
        self.until(what, || async move {
            let (x, y) = self.here().await;
            is_there(x, y).then_some(())
        })
        .await;
    }

    /// Ends all parts, then their nodes.
    pub(crate) async fn end(self) {
        for (_, running) in self.running {
            running.stop().await;
        }
    }
}

/// A vehicle's own directory, removed when dropped.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let name = format!("jaus-{name}-{}", std::process::id());
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
