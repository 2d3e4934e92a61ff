//! Operating zones in a whole vehicle: a mission keeps to them, also to one that is set on its way.

use jaus::address::JausId;
use jaus::component::{Component, Control, Update, When};
use jaus::messages::mobility::set_local_operating_zone::{
    LocalExclusionZoneRec, LocalExclusionZoneSeq, LocalPolygonPointRec, X, Y,
};
use jaus::messages::mobility::{
    QueryExcursion, QueryLocalPose, SetLocalOperatingZone, SetWrenchEffort, delete_zone,
    set_wrench_effort,
};
use jaus::node::Node;
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{QueryMission, QueryPlannedPath, SetDestination};
use jaus_vehicle::zones::{Point, Polygon};

use super::whole_vehicle::{LOOK, WholeVehicle};

/// A vehicle, and an operator who controls its store and its planner.
struct Scene {
    vehicle: WholeVehicle,
    desk: Node,
    operator: Component,
    pose: JausId,
}

impl Scene {
    async fn new(subsystem: u16) -> Self {
        let vehicle = WholeVehicle::start(subsystem, None);
        let (desk, operator) = vehicle.operator();
        let pose = JausId::new(subsystem, 41, 41);
        let is_up = || async {
            operator
                .query(pose, &QueryLocalPose::none().with_x())
                .await
                .is_ok()
        };
        within_limit(async {
            while !is_up().await {
                tokio::time::sleep(LOOK).await;
            }
        })
        .await;
        Self {
            vehicle,
            desk,
            operator,
            pose,
        }
    }

    /// Control of the part with this number.
    async fn control(&self, number: u8) -> Control {
        let peer = JausId::new(self.pose.subsystem(), number, number);
        self.operator.control(peer, 150).await.unwrap()
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

    async fn end(self) {
        drop(self.operator);
        self.desk.shutdown().await;
        self.vehicle.end().await;
    }
}

pub(crate) fn keep_out(number: u16, vertices: &[Point]) -> SetLocalOperatingZone {
    let vertex = |&(x, y): &Point| LocalExclusionZoneSeq {
        local_exclusion_zone_rec: LocalExclusionZoneRec {
            zone_id: delete_zone::ZoneId(number),
        },
        local_polygon_point_rec: LocalPolygonPointRec {
            x: X::new(x).unwrap(),
            y: Y::new(y).unwrap(),
            ..LocalPolygonPointRec::default()
        },
    };
    SetLocalOperatingZone {
        local_exclusion_zones: vec![vertices.iter().map(vertex).collect()],
        ..SetLocalOperatingZone::default()
    }
}

/// A square around a point.
pub(crate) fn square((x, y): Point, half: f64) -> [Point; 4] {
    let (south, north, west, east) = (x - half, x + half, y - half, y + half);
    [(south, west), (north, west), (north, east), (south, east)]
}

#[tokio::test(start_paused = true)]
async fn a_mission_drives_round_a_zone_that_is_set_on_its_way() {
    let scene = Scene::new(1121).await;
    let store = scene.control(61).await;
    let planner = scene.control(36).await;
    planner.resume().await.unwrap();
    let go = SetDestination {
        x: 6.0,
        y: 5.0,
        speed: Some(0.6),
        approved: Approved::YES,
    };
    planner.deliver(&go).await.unwrap();
    let operator = &scene.operator;
    let mut poses = operator
        .subscribe(
            scene.pose,
            &QueryLocalPose::none().with_x().with_y(),
            When::hz(20.0),
        )
        .await
        .unwrap();
    // As soon as the vehicle moves, a zone appears 2 m before the destination.
    within_limit(async {
        while scene.here().await.0.hypot(scene.here().await.1) < 0.3 {
            tokio::time::sleep(LOOK).await;
        }
    })
    .await;
    let path = operator
        .query(planner.peer(), &QueryPlannedPath {})
        .await
        .unwrap();
    let [.., before, last] = path.point_list.as_slice() else {
        panic!("{path:?}");
    };
    let length = (last.x - before.x).hypot(last.y - before.y);
    let share = 2.0 / length;
    let middle = (
        last.x + (before.x - last.x) * share,
        last.y + (before.y - last.y) * share,
    );
    let vertices = square(middle, 0.6);
    let zone = Polygon::new(vertices.to_vec()).unwrap();
    store.deliver(&keep_out(7, &vertices)).await.unwrap();
    let mut least = f64::INFINITY;
    let arrival = async {
        loop {
            if let Some(Update::Report(pose)) = poses.next().await
                && let Some(place) = pose.x_m().zip(pose.y_m())
            {
                least = least.min(zone.signed_distance(place));
            }
            let report = operator
                .query(planner.peer(), &QueryMission {})
                .await
                .unwrap();
            assert_ne!(report.stage, Stage::FAILED, "{report:?}");
            if report.stage == Stage::ARRIVED {
                return;
            }
        }
    };
    within_limit(arrival).await;
    assert!(least > 0.25, "{least:.2} m from the zone");
    let (x, y) = scene.here().await;
    assert!((x - 6.0).hypot(y - 5.0) < 0.5, "{x:.2}, {y:.2}");
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn full_effort_by_hand_ends_before_a_zone() {
    let scene = Scene::new(1131).await;
    let store = scene.control(61).await;
    store
        .deliver(&keep_out(7, &square((4.0, 0.0), 1.5)))
        .await
        .unwrap();
    let driver = scene.control(33).await;
    driver.resume().await.unwrap();
    // The driver has heard of the zone when the store has, and half a second has passed.
    tokio::time::sleep(std::time::Duration::from_secs(2)).await;
    let effort = SetWrenchEffort {
        propulsive_linear_effort_x: set_wrench_effort::PropulsiveLinearEffortX::new(100.0).ok(),
        ..SetWrenchEffort::default()
    };
    for _ in 0..80 {
        driver.send(&effort).unwrap();
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    let (x, _) = scene.here().await;
    assert!((1.5..2.25).contains(&x), "{x:.2} m: the edge is at 2.5 m");
    let report = scene
        .operator
        .query(store.peer(), &QueryExcursion::default())
        .await
        .unwrap();
    assert_eq!(report.excursion.len(), 1);
    assert_eq!(report.excursion[0].zone_status.0, 0);
    scene.end().await;
}
