//! Operating zones in a whole vehicle: a mission keeps to them, also to one that is set on its way.

use std::time::Duration;

use jaus::component::{Update, When};
use jaus::messages::mobility::set_local_operating_zone::{
    LocalExclusionZoneRec, LocalExclusionZoneSeq, LocalPolygonPointRec, X, Y,
};
use jaus::messages::mobility::{
    QueryExcursion, QueryLocalPose, SetLocalOperatingZone, SetWrenchEffort, delete_zone,
    primitive_driver, set_wrench_effort,
};
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{QueryMission, SetDestination, mission_planner};
use jaus_vehicle::zones::{Point, Polygon};

use crate::scene::{PLANNER, POSE, PRIMITIVE, STORE};
use crate::whole_vehicle::WholeVehicle;

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
    let vehicle = WholeVehicle::start("round-zone", None);
    let store = vehicle.lease(STORE).await;
    let planner = vehicle.control(PLANNER, mission_planner::URN).await;
    let go = SetDestination {
        x: 6.0,
        y: 5.0,
        speed: Some(0.6),
        approved: Approved::YES,
    };
    planner.deliver(&go).await.unwrap();
    let query = QueryLocalPose::none().with_x().with_y();
    let poses = vehicle.client.subscribe(POSE, &query, When::hz(20.0));
    let mut poses = poses.await.unwrap();
    // As soon as the vehicle moves, a zone appears before the destination.
    vehicle.until_at("sets out", |x, y| x.hypot(y) > 0.3).await;
    let vertices = square(vehicle.planned(2.0).await, 0.6);
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
            let report = vehicle.client.query(PLANNER, &QueryMission {}).await;
            let report = report.unwrap();
            assert_ne!(report.stage, Stage::FAILED, "{report:?}");
            if report.stage == Stage::ARRIVED {
                return;
            }
        }
    };
    within_limit(arrival).await;
    assert!(least > 0.25, "{least:.2} m from the zone");
    let (x, y) = vehicle.here().await;
    assert!((x - 6.0).hypot(y - 5.0) < 0.5, "{x:.2}, {y:.2}");
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn full_effort_by_hand_ends_before_a_zone() {
    let vehicle = WholeVehicle::start("effort-zone", None);
    let store = vehicle.lease(STORE).await;
    let zone = keep_out(7, &square((4.0, 0.0), 1.5));
    store.deliver(&zone).await.unwrap();
    let driver = vehicle.control(PRIMITIVE, primitive_driver::URN).await;
    // The driver has heard of the zone when the store has, and half a second has passed.
    tokio::time::sleep(Duration::from_secs(2)).await;
    let effort = SetWrenchEffort {
        propulsive_linear_effort_x: set_wrench_effort::PropulsiveLinearEffortX::new(100.0).ok(),
        ..SetWrenchEffort::default()
    };
    for _ in 0..80 {
        driver.send(&effort).unwrap();
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let (x, _) = vehicle.here().await;
    assert!((1.5..2.25).contains(&x), "{x:.2} m: the edge is at 2.5 m");
    let query = QueryExcursion::default();
    let report = vehicle.client.query(STORE, &query).await.unwrap();
    assert_eq!(report.excursion.len(), 1);
    assert_eq!(report.excursion[0].zone_status.0, 0);
    vehicle.end().await;
}
