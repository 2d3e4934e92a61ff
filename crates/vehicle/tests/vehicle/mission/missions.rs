//! Missions that arrive, restart, and are stopped.

use jaus_test_kit::waiting::{until, within_limit};
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::report_stage::State;
use jaus_vehicle::messages::ground::{
    ApproveMission, ContinueMission, QueryPlannedPath, ReportPlannedPath, StopMission,
};

use super::fake::{World, store};

#[tokio::test(start_paused = true)]
async fn a_mission_is_planned_approved_and_driven_to_its_end() {
    let mut world = World::new(1011).await;
    for column in 0..12 {
        world.cells.lock().unwrap()[5 * 16 + column] = 0;
    }
    world.go(9.5, 1.5, false).await;
    let report = world.until_stage(Stage::AWAITING_APPROVAL).await;
    assert!(report.remaining > 20.0, "around the wall: {report:?}");
    let peer = world.control.peer();
    let path: ReportPlannedPath = world
        .operator
        .query(peer, &QueryPlannedPath {})
        .await
        .unwrap();
    assert!(path.point_list.len() >= 3, "{path:?}");
    let approve = ApproveMission {
        mission: report.mission,
    };
    world.control.deliver(&approve).await.unwrap();
    world.engage().await;
    until(|| world.vehicle.motion().pose.distance(9.5, 1.5) <= 0.5).await;
    let component = world.path.component.clone();
    world.path.stage.set(&component, State::DONE, "").await;
    let report = world.until_stage(Stage::ARRIVED).await;
    assert_eq!((report.attempt, report.progress), (1, 100));
    let mut standing = component.watch_standing();
    let free = standing.wait_for(|standing| standing.controller.is_none());
    within_limit(free).await.unwrap();
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_that_a_blocked_stage_has_stopped_waits_until_it_is_continued() {
    let mut world = World::new(1021).await;
    world.go(9.5, 9.5, true).await;
    world.engage().await;
    let component = world.vector.component.clone();
    world
        .vector
        .stage
        .set(&component, State::BLOCKED, "no pose")
        .await;
    let report = world.until_stage(Stage::WAITING).await;
    assert_eq!(report.reason.as_str(), Some("the vector driver: no pose"));
    for driver in [&world.path, &world.vector] {
        driver.stage.set(&driver.component, State::IDLE, "").await;
    }
    tokio::time::sleep(std::time::Duration::from_secs(60)).await;
    let report = world.until(|_| true).await;
    assert_eq!(report.stage, Stage::WAITING, "not by itself");
    assert!(world.path.component.standing().controller.is_none());
    let mission = report.mission;
    let go_on = ContinueMission { mission };
    world.control.deliver(&go_on).await.unwrap();
    world.engage().await;
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn whoever_takes_over_a_driver_ends_the_mission_and_it_does_not_go_on() {
    let mut world = World::new(1031).await;
    world.go(9.5, 9.5, true).await;
    world.engage().await;
    let primitive = world.primitive.component.id();
    let by_hand = world.operator.control(primitive, 200).await.unwrap();
    let report = world.until_stage(Stage::STOPPED).await;
    assert_eq!(
        report.reason.as_str(),
        Some("1032.1.1 has taken control of the primitive driver (1031.1.33)")
    );
    by_hand.release().await;
    tokio::time::sleep(std::time::Duration::from_secs(1)).await;
    let report = world.until(|_| true).await;
    assert_eq!(report.stage, Stage::STOPPED);
    assert!(world.path.component.standing().controller.is_none());
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn an_emergency_of_a_driver_ends_the_mission() {
    let mut world = World::new(1041).await;
    world.go(9.5, 9.5, true).await;
    world.engage().await;
    let path = world.path.component.id();
    world.operator.set_emergency(path).await.unwrap();
    let report = world.until_stage(Stage::STOPPED).await;
    let reason = report.reason.to_string_lossy();
    assert!(
        reason.contains("an emergency stopped the path segment driver"),
        "{reason}"
    );
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn a_driver_that_stands_down_ends_the_mission() {
    let mut world = World::new(1081).await;
    world.go(9.5, 9.5, true).await;
    world.engage().await;
    let component = world.path.component.clone();
    let reason = "101.1.33 is controlled by 42.1.1";
    world.path.stage.stand_down(&component, reason).await;
    let report = world.until_stage(Stage::STOPPED).await;
    let told = report.reason.to_string_lossy();
    assert!(told.ends_with(reason), "{told}");
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn the_operator_stops_it_and_the_driver_is_given_back() {
    let mut world = World::new(1051).await;
    world.go(9.5, 9.5, true).await;
    world.engage().await;
    world.control.deliver(&StopMission {}).await.unwrap();
    world.until_stage(Stage::STOPPED).await;
    let mut standing = world.path.component.watch_standing();
    let free = standing.wait_for(|standing| standing.controller.is_none());
    within_limit(free).await.unwrap();
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn mistakes_are_told_with_what_to_do() {
    let mut world = World::new(1061).await;
    world.go(99.0, 9.5, true).await;
    let report = world.until_stage(Stage::FAILED).await;
    let reason = report.reason.to_string_lossy().into_owned();
    assert!(reason.contains("is outside the map"), "{reason}");
    world.shut_down().await;
}

#[tokio::test(start_paused = true)]
async fn a_store_that_comes_back_is_asked_again() {
    let mut world = World::new(1071).await;
    drop(world.store.take());
    world.go(9.5, 9.5, false).await;
    let report = world.until(|report| report.attempt == 2).await;
    assert!(!report.reason.is_empty());
    let node = world.node();
    world.store = Some(store(&node, world.cells.clone()));
    world.until_stage(Stage::AWAITING_APPROVAL).await;
    world.shut_down().await;
}
