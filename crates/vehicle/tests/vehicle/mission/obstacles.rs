//! Obstacles in a whole vehicle: a mission leads round what the range sensor sees, or stops before it
//! and says why.

use jaus::address::JausId;
use jaus::component::{Control, Update, When};
use jaus::messages::mobility::QueryLocalPose;
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{
    QueryMission, ReportMission, SetDestination, mission_planner,
};
use jaus_vehicle::parts::RangeSensor;
use jaus_vehicle::sensing::{Disc, Scenery};
use jaus_vehicle::zones::Point;

use crate::scene::{PLANNER, POSE};
use crate::whole_vehicle::WholeVehicle;

const RANGE_SENSOR: JausId = JausId::new(101, 51, 51);
const DESTINATION: Point = (6.0, 5.0);

/// A vehicle with a range sensor whose planner is controlled.
struct Scene {
    vehicle: WholeVehicle,
    scenery: Scenery,
    planner: Control,
}

impl Scene {
    /// A vehicle that has begun its mission.
    async fn under_way(name: &str) -> Self {
        let mut vehicle = WholeVehicle::start(name, None);
        let scenery = Scenery::default();
        let sensor = RangeSensor {
            scenery: scenery.clone(),
            ..RangeSensor::default()
        };
        vehicle.run(RANGE_SENSOR, sensor);
        let planner = vehicle.control(PLANNER, mission_planner::URN).await;
        let (x, y) = DESTINATION;
        let go = SetDestination {
            x,
            y,
            speed: Some(0.8),
            approved: Approved::YES,
        };
        planner.deliver(&go).await.unwrap();
        vehicle.until_at("sets out", |x, y| x.hypot(y) > 0.3).await;
        Self {
            vehicle,
            scenery,
            planner,
        }
    }

    async fn mission(&self) -> ReportMission {
        let report = self
            .vehicle
            .client
            .query(self.planner.peer(), &QueryMission {});
        report.await.unwrap()
    }

    /// Waits until the mission has arrived or failed.
    async fn ends(&self, discs: &[Disc]) -> Ending {
        let query = QueryLocalPose::none().with_x().with_y();
        let poses = self.vehicle.client.subscribe(POSE, &query, When::hz(20.0));
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

    async fn end(self) {
        drop(self.planner);
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
    let scene = Scene::under_way("round-obstacle").await;
    let disc = Disc {
        middle: scene.vehicle.planned(2.0).await,
        radius: 0.3,
    };
    scene.scenery.set(vec![disc]);
    let end = scene.ends(&[disc]).await;
    assert_eq!(end.report.stage, Stage::ARRIVED, "{:?}", end.report);
    assert!(end.saw_obstacle, "not only the driver that stops before it");
    assert!(end.least > 0.25, "{:.2} m from the obstacle", end.least);
    let (x, y) = scene.vehicle.here().await;
    assert!((x - DESTINATION.0).hypot(y - DESTINATION.1) < 0.5);
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_without_a_way_round_stops_before_the_obstacles_and_says_why() {
    let scene = Scene::under_way("ring").await;
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
    scene.vehicle.comes_to_rest().await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_stops_when_its_range_sensor_dies_and_says_why() {
    let mut scene = Scene::under_way("dead-range-sensor").await;
    scene.vehicle.kill(RANGE_SENSOR).await;
    let stopped = || async {
        let reason = scene.mission().await.reason.to_string();
        reason.contains("range sensor").then_some(())
    };
    scene.vehicle.until("a reason", stopped).await;
    scene.vehicle.comes_to_rest().await;
    scene.end().await;
}
