//! Several vehicles at one station: the list, selection, and stopping all of them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use jaus::component::State;
use jaus_ocu::Station;
use jaus_test_kit::waiting::within_limit;
use serde_json::{Value, json};

use crate::missing::planner;
use crate::scene::{Page, Scene};

/// A vehicle in the list.
fn listed(fleet: &Value, subsystem: u16) -> &Value {
    let all = fleet.as_array().unwrap();
    let found = all.iter().find(|it| it["subsystem"] == subsystem);
    found.unwrap_or(&Value::Null)
}

async fn take_and_resume(page: &mut Page) {
    page.until(|state| !state["vehicle"]["pose"].is_null())
        .await;
    page.ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
    page.ask(json!({"type": "resume"})).await.unwrap();
}

#[tokio::test]
async fn the_list_shows_every_vehicle_with_its_state_and_its_operator() {
    let scene = Scene::new().await;
    let _second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    let known = |fleet: &Value| {
        listed(fleet, 101)["state"] == "ready" && listed(fleet, 102)["state"] == "standby"
    };
    let fleet = page.fleet_until(known).await;
    assert_eq!(fleet.as_array().unwrap().len(), 2, "no stations: {fleet}");
    let (first, second) = (listed(&fleet, 101), listed(&fleet, 102));
    let driver = format!("operator (page {})", page.hello["page"]);
    assert_eq!(
        (&first["driver"], &first["held"]),
        (&json!(driver), &json!(true))
    );
    assert_eq!(
        (&first["controller"], &first["authority"]),
        (&json!("42.1.1"), &json!(200))
    );
    assert_eq!(
        (&second["driver"], &second["held"]),
        (&json!(""), &json!(false))
    );
    assert_eq!(
        (&second["name"], &second["presence"]),
        (&json!("Rover"), &json!("present"))
    );
    assert_eq!(second["controller"], Value::Null);
    assert!(second["age_ms"].as_u64().unwrap() < 4000, "{second}");
}

#[tokio::test]
async fn a_station_shows_only_the_vehicles_of_its_settings() {
    let station = Station {
        vehicles: vec![102, 103],
        ..Station::default()
    };
    let scene = Scene::with(station, 0).await;
    let _second = scene.another_vehicle(102);
    let mut page = scene.page().await;
    let fleet = page
        .fleet_until(|fleet| listed(fleet, 102)["presence"] == "present")
        .await;
    assert_eq!(listed(&fleet, 103)["presence"], "unknown");
    assert_eq!(listed(&fleet, 101), &Value::Null);
    let state = page.until(|state| !state["vehicle"].is_null()).await;
    assert_eq!(state["vehicle"]["subsystem"], 102);
    let refused = page.ask(json!({"type": "select", "subsystem": 101})).await;
    assert!(refused.unwrap_err().contains("not a known vehicle"));
}

#[tokio::test]
async fn selecting_another_vehicle_stops_and_releases_the_one_that_is_driven() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.select(102).await;
    scene
        .until(|scene| !scene.is_controlled() && scene.speed() == 0.0)
        .await;
    assert_eq!(page.drive(0.5).await.unwrap_err(), "take control first");

    take_and_resume(&mut page).await;
    page.drive_until(&scene, |_| second.speed() > 0.3).await;
    assert_eq!(scene.speed(), 0.0, "only the selected one is driven");
    let fleet = page
        .fleet_until(|fleet| listed(fleet, 102)["held"] == true)
        .await;
    assert_eq!(listed(&fleet, 101)["held"], false);
}

#[tokio::test]
async fn a_mission_goes_on_while_another_vehicle_is_selected_and_is_released_at_its_end() {
    let scene = Scene::new().await;
    let _second = scene.another_vehicle(102);
    let stage = Arc::new(AtomicU8::new(3));
    let planner = planner(&scene, Arc::clone(&stage));
    let is_controlled = || planner.standing().controller.is_some();
    let mut page = scene.page().await;
    page.select(101).await;
    page.until(|state| state["mission"]["stage"] == "awaiting_approval")
        .await;
    take_and_resume(&mut page).await;
    page.ask(json!({"type": "approve", "mission": 7}))
        .await
        .unwrap();
    stage.store(7, Ordering::Relaxed);
    page.until(|state| state["mission"]["stage"] == "driving")
        .await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    page.select(102).await;
    let driving = |fleet: &Value| {
        let first = listed(fleet, 101);
        first["mission"] == "driving" && first["held"] == true
    };
    page.fleet_until(driving).await;
    assert!(is_controlled());

    stage.store(8, Ordering::Relaxed);
    scene.until(|_| !is_controlled()).await;
    page.fleet_until(|fleet| listed(fleet, 101)["held"] == false)
        .await;
}

#[tokio::test]
async fn a_mission_is_not_taken_over_by_a_push_of_the_stick_but_by_a_request() {
    let scene = Scene::new().await;
    let stage = Arc::new(AtomicU8::new(3));
    let planner = planner(&scene, Arc::clone(&stage));
    let mut page = scene.page().await;
    page.until(|state| state["mission"]["stage"] == "awaiting_approval")
        .await;
    take_and_resume(&mut page).await;
    page.ask(json!({"type": "approve", "mission": 7}))
        .await
        .unwrap();
    stage.store(7, Ordering::Relaxed);
    page.until(|state| state["mission"]["stage"] == "driving")
        .await;
    let refused = page.drive(0.5).await.unwrap_err();
    assert_eq!(refused, "a mission drives: take over first");
    assert!(!scene.is_controlled(), "the planner has the drivers");
    assert!(planner.standing().controller.is_some());

    // The planner of this test does not know Stop Mission.
    let _ = page.ask(json!({"type": "take_over"})).await;
    stage.store(10, Ordering::Relaxed);
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn pages_drive_vehicles_of_their_own_and_none_changes_that_of_another() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut one = scene.driver().await;
    let mut other = scene.page().await;
    other.select(102).await;
    take_and_resume(&mut other).await;
    within_limit(async {
        while scene.speed() < 0.3 || second.speed() < 0.3 {
            for page in [&mut one, &mut other] {
                let push = page.push(0.5);
                page.say(&push).await;
                page.read_for(Duration::from_millis(50)).await;
            }
        }
    })
    .await;
    // Looking at the other's vehicle and back moves neither. Its own is left, and stops.
    other.select(101).await;
    let state = one.state().await;
    assert_eq!(state["vehicle"]["subsystem"], 101);
    assert_eq!(state["control"]["held"], true);
    one.drive_until(&scene, |scene| scene.speed() > 0.3 && second.speed() == 0.0)
        .await;
    let refused = other.drive(0.5).await.unwrap_err();
    assert!(refused.contains("controls vehicle 101"), "{refused}");
}

#[tokio::test]
async fn a_request_for_a_vehicle_that_is_not_selected_any_more_is_refused() {
    let scene = Scene::new().await;
    let _second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    page.select(102).await;
    let late = json!({"type": "control", "on": true, "vehicle": 101});
    let refused = page.ask(late).await.unwrap_err();
    assert_eq!(refused, "vehicle 101 is not selected any more");
}

/// Whether the list says that all vehicles are stopped, those that come later as well.
async fn is_latched(page: &mut Page, wanted: bool) {
    page.said_until("fleet", |fleet| fleet["all_stopped"] == wanted)
        .await;
}

#[tokio::test]
async fn stopping_all_is_shown_and_ends_with_the_last_emergency_that_is_cleared() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    is_latched(&mut page, false).await;
    page.ask(json!({"type": "emergency_all", "on": true}))
        .await
        .unwrap();
    is_latched(&mut page, true).await;
    // With one vehicle, its own emergency is the only one to clear.
    page.ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    is_latched(&mut page, false).await;
    let later = scene.another_vehicle(102);
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    assert_eq!(later.rover.standing().state, State::Standby);
}

#[tokio::test]
async fn stopping_all_goes_on_while_one_vehicle_of_several_is_cleared() {
    let scene = Scene::new().await;
    let _second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    page.ask(json!({"type": "emergency_all", "on": true}))
        .await
        .unwrap();
    page.ask(json!({"type": "emergency", "on": false, "vehicle": 102}))
        .await
        .unwrap();
    is_latched(&mut page, true).await;
    page.ask(json!({"type": "emergency_all", "on": false}))
        .await
        .unwrap();
    is_latched(&mut page, false).await;
}

#[tokio::test]
async fn one_request_stops_all_vehicles_and_those_that_come_later() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.ask(json!({"type": "emergency_all", "on": true}))
        .await
        .unwrap();
    scene.until(|scene| scene.speed() == 0.0).await;
    assert_eq!(second.rover.standing().state, State::Emergency);
    let third = scene.another_vehicle(103);
    scene
        .until(|_| third.rover.standing().state == State::Emergency)
        .await;

    page.ask(json!({"type": "emergency_all", "on": false}))
        .await
        .unwrap();
    for vehicle in [&second, &third] {
        assert_eq!(vehicle.rover.standing().state, State::Standby);
    }
    page.until(|state| state["vehicle"]["emergency"] == false)
        .await;
}

#[tokio::test]
async fn an_emergency_stops_the_vehicle_that_the_page_means_and_no_other() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut page = scene.driver().await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    page.ask(json!({"type": "emergency", "on": true, "vehicle": 102}))
        .await
        .unwrap();
    assert_eq!(second.rover.standing().state, State::Emergency);
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_vehicle_that_vanishes_is_shown_as_gone_and_comes_back_by_itself() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut page = scene.page().await;
    page.fleet_until(|fleet| listed(fleet, 102)["state"] == "standby")
        .await;
    drop(second.rover);
    second.node.shutdown().await;
    page.fleet_until(|fleet| listed(fleet, 102)["presence"] == "gone")
        .await;
    let _back = scene.another_vehicle(102);
    let is_back = |fleet: &Value| {
        listed(fleet, 102)["presence"] == "present" && listed(fleet, 102)["state"] == "standby"
    };
    page.fleet_until(is_back).await;
}

#[tokio::test]
async fn a_station_with_200_vehicles_drives_one_and_stops_all() {
    const VEHICLES: u16 = 200;
    let scene = Scene::new().await;
    let _others = scene.unmoving_vehicles(102..101 + VEHICLES);
    let mut page = scene.driver().await;
    let all = |fleet: &Value| {
        let all = fleet.as_array().unwrap();
        let known = all.iter().filter(|it| it["state"] != Value::Null);
        known.count() == usize::from(VEHICLES)
    };
    page.fleet_until(all).await;
    // The frame that is sent ten times a second does not grow with the number of vehicles.
    assert!(page.state().await.to_string().len() < 4096);
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.ask(json!({"type": "emergency_all", "on": true}))
        .await
        .unwrap();
    let stopped = |fleet: &Value| {
        let all = fleet.as_array().unwrap();
        all.iter().all(|it| it["state"] == "emergency")
    };
    page.fleet_until(stopped).await;
}
