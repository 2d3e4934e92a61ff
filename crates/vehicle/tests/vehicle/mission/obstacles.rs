//! Obstacles in a whole vehicle: a mission leads round what the range sensor sees, or stops before it
//! and says why.

use jaus::address::JausId;
use jaus::component::{Component, Control, Update, When};
use jaus::messages::mobility::{QueryLocalPose, QueryVelocityState};
use jaus::node::Node;
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{
    QueryMission, QueryPlannedPath, ReportMission, SetDestination,
};
use jaus_vehicle::parts::RangeSensor;
use jaus_vehicle::sensing::{Disc, Scenery};
use jaus_vehicle::zones::Point;

use super::whole_vehicle::{LOOK, WholeVehicle};

/// Number of its component and its node.
const RANGE_SENSOR: u8 = 51;
const DESTINATION: Point = (6.0, 5.0);

/// A vehicle with a range sensor, and an operator who controls its planner.
struct Scene {
    vehicle: WholeVehicle,
    scenery: Scenery,
    desk: Node,
    operator: Component,
    planner: Control,
    pose: JausId,
}

impl Scene {
    /// A vehicle that has begun its mission.
    async fn under_way(subsystem: u16) -> Self {
        let mut vehicle = WholeVehicle::start(subsystem, None);
        let scenery = Scenery::default();
        let sensor = RangeSensor {
            scenery: scenery.clone(),
            ..RangeSensor::default()
        };
        vehicle.run(RANGE_SENSOR, sensor);
        let (desk, operator) = vehicle.operator();
        let planner = JausId::new(subsystem, 36, 36);
        let engage = async {
            loop {
                if let Ok(control) = operator.control(planner, 150).await
                    && control.resume().await.is_ok()
                {
                    return control;
                }
                tokio::time::sleep(LOOK).await;
            }
        };
        let planner = within_limit(engage).await;
        let (x, y) = DESTINATION;
        let go = SetDestination {
            x,
            y,
            speed: Some(0.8),
            approved: Approved::YES,
        };
        planner.deliver(&go).await.unwrap();
        let scene = Self {
            vehicle,
            scenery,
            desk,
            operator,
            planner,
            pose: JausId::new(subsystem, 41, 41),
        };
        within_limit(async {
            while scene.here().await.0.hypot(scene.here().await.1) < 0.3 {
                tokio::time::sleep(LOOK).await;
            }
        })
        .await;
        scene
    }

    /// The vehicle's position, once it is known.
    async fn here(&self) -> Point {
        let query = QueryLocalPose::none().with_x().with_y();
        loop {
            let pose = self.operator.query(self.pose, &query).await;
            if let Some(place) = pose.ok().and_then(|it| it.x_m().zip(it.y_m())) {
                return place;
            }
            tokio::time::sleep(LOOK).await;
        }
    }

    async fn mission(&self) -> ReportMission {
        let report = self.operator.query(self.planner.peer(), &QueryMission {});
        report.await.unwrap()
    }

    /// The point of the planned path this far before its end.
    async fn before_the_end(&self, distance: f64) -> Point {
        let query = QueryPlannedPath {};
        let path = self.operator.query(self.planner.peer(), &query).await;
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

    /// Waits until the mission has arrived or failed.
    async fn ends(&self, discs: &[Disc]) -> Ending {
        let query = QueryLocalPose::none().with_x().with_y();
        let poses = self.operator.subscribe(self.pose, &query, When::hz(20.0));
        let mut poses = poses.await.unwrap();
        let mut least = f64::INFINITY;
        let mut saw_obstacle = false;
        let waiting = async {
            loop {
                if let Some(Update::Report(pose)) = poses.next().await
                    && let Some((x, y)) = pose.x_m().zip(pose.y_m())
                {
                    for Disc { middle, radius } in discs {
                        let distance = (middle.0 - x).hypot(middle.1 - y) - radius;
                        least = least.min(distance);
                    }
                }
                let report = self.mission().await;
                let reason = report.reason.to_string();
                saw_obstacle |= reason.contains("the range sensor sees an obstacle on the path");
                if [Stage::ARRIVED, Stage::FAILED].contains(&report.stage) {
                    return report;
                }
            }
        };
        let report = within_limit(waiting).await;
        Ending {
            report,
            least,
            saw_obstacle,
        }
    }

    async fn comes_to_rest(&self) {
        let velocity = JausId::new(self.pose.subsystem(), 42, 42);
        let query = QueryVelocityState::none().with_velocity_x();
        let rest = async {
            loop {
                let report = self.operator.query(velocity, &query).await.unwrap();
                if report
                    .velocity_x_m_per_s()
                    .is_some_and(|it| it.abs() < 0.02)
                {
                    return;
                }
                tokio::time::sleep(LOOK).await;
            }
        };
        within_limit(rest).await;
    }

    async fn end(self) {
        drop(self.planner);
        drop(self.operator);
        self.desk.shutdown().await;
        self.vehicle.end().await;
    }
}

/// The end of a mission.
struct Ending {
    report: ReportMission,
    /// Least distance of the vehicle's centre from the edge of a disc on the way, in metres.
    least: f64,
    /// Whether the planner gave up a path for an obstacle.
    saw_obstacle: bool,
}

#[tokio::test(start_paused = true)]
async fn a_mission_drives_round_an_obstacle_that_appears_on_its_way() {
    let scene = Scene::under_way(1141).await;
    let disc = Disc {
        middle: scene.before_the_end(2.0).await,
        radius: 0.3,
    };
    scene.scenery.set(vec![disc]);
    let end = scene.ends(&[disc]).await;
    assert_eq!(end.report.stage, Stage::ARRIVED, "{:?}", end.report);
    assert!(end.saw_obstacle, "not only the driver that stops before it");
    assert!(end.least > 0.25, "{:.2} m from the obstacle", end.least);
    let (x, y) = scene.here().await;
    assert!((x - DESTINATION.0).hypot(y - DESTINATION.1) < 0.5);
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_without_a_way_round_stops_before_the_obstacles_and_says_why() {
    let scene = Scene::under_way(1143).await;
    // A ring around the destination.
    let post = |number: u32| {
        let (sin, cos) = (f64::from(number) * std::f64::consts::TAU / 24.0).sin_cos();
        Disc {
            middle: (DESTINATION.0 + 1.4 * cos, DESTINATION.1 + 1.4 * sin),
            radius: 0.25,
        }
    };
    let discs: Vec<Disc> = (0..24).map(post).collect();
    scene.scenery.set(discs.clone());
    let end = scene.ends(&discs).await;
    assert_eq!(end.report.stage, Stage::FAILED, "{:?}", end.report);
    let reason = end.report.reason.to_string();
    assert!(reason.contains("obstacle"), "{reason}");
    assert!(end.least > 0.25, "{:.2} m from an obstacle", end.least);
    scene.comes_to_rest().await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_stops_when_its_range_sensor_dies_and_says_why() {
    let mut scene = Scene::under_way(1145).await;
    scene.vehicle.kill(RANGE_SENSOR).await;
    let stopped = async {
        loop {
            let reason = scene.mission().await.reason.to_string();
            if reason.contains("range sensor") {
                return;
            }
            tokio::time::sleep(LOOK).await;
        }
    };
    within_limit(stopped).await;
    scene.comes_to_rest().await;
    scene.end().await;
}
