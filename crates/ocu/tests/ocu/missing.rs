//! Pages with a part of the vehicle missing, and pages that fall silent.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, UNIX_EPOCH};

use jaus::component::{Component, Handlers, Kind, Management, Time, TimeOfDay};
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::messages::ground::{
    ContinueMission, QueryMission, ReportMission, mission_planner,
};
use serde_json::{Value, json};

use crate::scene::{Page, Scene, driver_of};

fn missing(state: &Value) -> Vec<&Value> {
    let missing = state["vehicle"]["missing"].as_array();
    missing.into_iter().flatten().collect()
}

#[tokio::test]
async fn a_driver_that_ends_is_named_and_nobody_drives_until_it_is_back() {
    let mut scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    scene.end_rover();
    // It is silent before Discovery reports it lost.
    let is_gone = |state: &Value| missing(state).iter().any(|it| it["how"] == "gone");
    let state = page.until(is_gone).await;
    let part = missing(&state)[0];
    assert_eq!(part["name"], "Primitive Driver");
    assert_eq!(part["id"], "101.1.1");
    let why = &state["vehicle"]["stale"];
    assert_eq!(why, "the primitive driver 101.1.1 is gone");
    page.drive(0.5).await.unwrap_err();

    scene.start_rover().await;
    page.until(|state| missing(state).is_empty() && state["vehicle"]["stale"].is_null())
        .await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

/// The state of a component in the tree; `None` if the tree lacks it.
fn in_tree<'t>(tree: &'t Value, id: &str) -> Option<&'t str> {
    let list = |of: &'t Value, name: &str| of[name].as_array().into_iter().flatten();
    let nodes = list(tree, "subsystems").flat_map(|it| list(it, "nodes"));
    let mut components = nodes.flat_map(|it| list(it, "components"));
    components.find(|it| it["id"] == id)?["state"].as_str()
}

#[tokio::test]
async fn the_tree_shows_the_state_of_every_component_and_keeps_those_that_are_gone() {
    let mut scene = Scene::new().await;
    let _other = scene.another_vehicle(102);
    let sensor = Component::builder(Kind::Vehicle, "Rover");
    let _sensor = scene.attach(42, sensor.offer(scene.vehicle.velocity_state_sensor()));
    scene.page().await.select(101).await;
    // A page that connects later gets the tree as it is.
    let mut page = scene.page().await;
    let expected = [
        ("101.1.1", "standby"),
        ("101.1.42", "present"),
        ("102.1.1", "standby"),
    ];
    let is_complete = |tree: &Value| {
        let mut all = expected.iter();
        all.all(|(id, state)| in_tree(tree, id) == Some(state))
    };
    page.said_until("tree", is_complete).await;
    scene.end_rover();
    let is_gone = |tree: &Value| in_tree(tree, "101.1.1") == Some("gone");
    page.said_until("tree", is_gone).await;
    scene.start_rover().await;
    page.said_until("tree", is_complete).await;
}

#[tokio::test]
async fn a_pose_that_freezes_ends_manual_drive_although_it_is_still_reported() {
    let frozen = Arc::new(AtomicBool::new(false));
    let scene = Scene::with_frozen_pose(Arc::clone(&frozen)).await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    frozen.store(true, Ordering::Relaxed);
    let refused = within_limit(async {
        loop {
            if let Err(refused) = page.drive(0.5).await {
                return refused;
            }
        }
    })
    .await;
    assert!(refused.contains("no new pose"), "{refused}");
    let state = page.state().await;
    let x = state["vehicle"]["pose"]["x"].as_f64().unwrap();
    assert!((x - 3.0).abs() < 0.01, "{x}");
    assert!(state["vehicle"]["pose"]["age_ms"].as_u64().unwrap() >= 1000);
    assert!(missing(&state).is_empty(), "the sensor does report");
    scene.until(|scene| scene.speed() == 0.0).await;
    frozen.store(false, Ordering::Relaxed);
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_pose_that_always_arrives_late_by_the_clock_of_its_sensor_is_too_old_to_drive_by() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    let late = Duration::from_secs(3);
    let clock = TimeOfDay::new(move || UNIX_EPOCH.elapsed().unwrap() + late);
    let rover = scene.rover.as_ref().unwrap();
    rover.offer(Time::new(clock)).await.unwrap();
    let age = |state: &Value| state["vehicle"]["pose"]["age_ms"].as_u64();
    let state = page.until(|state| age(state) >= Some(2900)).await;
    assert!(age(&state) < Some(10_000), "{state}");
    scene.until(|scene| scene.speed() == 0.0).await;
    let refused = page.drive(0.5).await.unwrap_err();
    assert!(refused.contains("stale"), "{refused}");
}

#[tokio::test]
async fn a_page_that_falls_silent_while_it_drives_is_told_why_the_vehicle_stopped() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    // The page is silent from now on.
    let silent = |state: &Value| state["drive"]["reason"] != "";
    let state = page.until(silent).await;
    let reason = state["drive"]["reason"].as_str().unwrap();
    assert!(reason.contains("no command from the page"), "{reason}");
    assert_eq!(state["drive"]["active"], false);
    scene.until(|scene| scene.speed() == 0.0).await;

    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.ask(json!({"type": "drive_end"})).await.unwrap();
    let state = page.until(|state| state["drive"]["active"] == false).await;
    assert_eq!(state["drive"]["reason"], "", "it was let go");

    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.until(silent).await;
    page.ask(json!({"type": "control", "on": false}))
        .await
        .unwrap();
    let state = page.until(|state| state["control"]["held"] == false).await;
    assert_eq!(
        state["drive"]["reason"], "",
        "the next operator did not drive"
    );
}

/// A planner with mission 7 in the given stage, which drives when it is told to continue.
pub(crate) fn planner(scene: &Scene, stage: Arc<AtomicU8>) -> Component {
    let continued = Arc::clone(&stage);
    let mission = Handlers::new(mission_planner::LATEST).answer(move |_: QueryMission| {
        let stage = stage.load(Ordering::Relaxed).into();
        ReportMission {
            mission: 7,
            stage,
            ..ReportMission::default()
        }
    });
    let mission = mission
        .command(move |command: ContinueMission, _, _| {
            if command.mission == 7 {
                continued.store(7, Ordering::Relaxed);
            }
        })
        .on_stop(|_| {});
    scene.attach(
        36,
        Component::builder(Kind::Vehicle, "Rover")
            .management(Management::default())
            .offer(mission),
    )
}

/// A page whose operator has approved mission 7 of a planner, which drives.
async fn on_mission(scene: &Scene, stage: &AtomicU8) -> Page {
    let mut page = scene.page().await;
    page.until(|state| state["mission"]["stage"] == "awaiting_approval")
        .await;
    page.until(|state| state["vehicle"]["stale"].is_null())
        .await;
    page.ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
    page.ask(json!({"type": "resume"})).await.unwrap();
    page.ask(json!({"type": "approve", "mission": 7}))
        .await
        .unwrap();
    stage.store(7, Ordering::Relaxed);
    page.until(|state| state["mission"]["stage"] == "driving" && driver_of(state)["ours"] == false)
        .await;
    page
}

#[tokio::test]
async fn a_planner_that_ends_while_it_drives_is_named_and_the_station_stops_the_vehicle() {
    let scene = Scene::new().await;
    let stage = Arc::new(AtomicU8::new(3));
    let planner = planner(&scene, Arc::clone(&stage));
    let mut page = on_mission(&scene, &stage).await;

    drop(planner);
    let stopped = |state: &Value| {
        state["mission"]["lost"]["told_to_stop"] == true
            && driver_of(state)["ours"] == true
            && driver_of(state)["state"] == "standby"
    };
    let state = page.until(stopped).await;
    assert_eq!(state["mission"]["lost"]["id"], "101.1.36");
    let refused = page.drive(0.5).await.unwrap_err();
    assert!(refused.contains("resume first"), "{refused}");
}

#[tokio::test]
async fn a_planner_that_restarts_while_it_drives_is_named_and_the_station_stops_the_vehicle() {
    planner_restarts_with(0).await;
}

#[tokio::test]
async fn a_planner_that_restarts_and_reports_at_once_that_it_drives_is_not_the_one_that_was_approved()
 {
    planner_restarts_with(7).await;
}

/// A planner restarts while it drives, and is in this stage then.
async fn planner_restarts_with(new_stage: u8) {
    let scene = Scene::new().await;
    let stage = Arc::new(AtomicU8::new(3));
    let first = planner(&scene, Arc::clone(&stage));
    let mut page = on_mission(&scene, &stage).await;

    drop(first);
    scene.until(|scene| scene.is_free(36)).await;
    stage.store(new_stage, Ordering::Relaxed);
    let _second = planner(&scene, Arc::clone(&stage));
    let stopped = |state: &Value| {
        state["mission"]["lost"]["told_to_stop"] == true && driver_of(state)["state"] == "standby"
    };
    let state = page.until(stopped).await;
    assert_eq!(state["mission"]["lost"]["how"], "restarted", "{state}");
    assert_eq!(missing(&state)[0]["how"], "restarted");
    // The operator drives on.
    page.ask(json!({"type": "resume"})).await.unwrap();
    page.until(|state| state["mission"]["lost"].is_null() && missing(state).is_empty())
        .await;
}

#[tokio::test]
async fn a_mission_that_a_fault_has_stopped_goes_on_when_the_operator_continues_it() {
    let scene = Scene::new().await;
    let stage = Arc::new(AtomicU8::new(11));
    let _planner = planner(&scene, Arc::clone(&stage));
    let mut page = scene.page().await;
    page.until(|state| state["mission"]["stage"] == "waiting")
        .await;
    let go_on = json!({"type": "continue", "mission": 7});
    page.ask(go_on.clone()).await.unwrap_err();
    page.ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
    page.ask(json!({"type": "resume"})).await.unwrap();
    page.ask(go_on).await.unwrap();
    page.until(|state| state["mission"]["stage"] == "driving" && driver_of(state)["ours"] == false)
        .await;
}
