//! Operator actions: view, take control, drive, release, stop; with one and with two operators.

use std::sync::Arc;
use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use jaus_ocu::Station;
use jaus_test_kit::waiting::within_limit;
use serde_json::json;
use tokio_tungstenite::tungstenite::Message;

use crate::missing::planner;
use crate::scene::{Page, Scene, driver_of, planner_of};

#[tokio::test]
async fn a_page_sees_the_vehicle_and_its_parts_without_asking() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    assert_eq!(page.hello["token_needed"], false);
    assert_eq!(page.hello["operator"], "42.1.1");
    let complete = |state: &serde_json::Value| {
        let vehicle = &state["vehicle"];
        !vehicle["pose"].is_null()
            && !vehicle["velocity"].is_null()
            && driver_of(state)["state"] == "standby"
    };
    let state = page.until(complete).await;
    assert_eq!(state["vehicle"]["subsystem"], 101);
    assert_eq!(state["vehicle"]["name"], "Rover");
    assert_eq!(driver_of(&state)["id"], "101.1.1");
    assert_eq!(state["control"]["held"], false);
    assert_eq!(state["mission"], json!(null));
    let mut other = scene.page().await;
    let both = |tree: &serde_json::Value| {
        let subsystems = tree["subsystems"].as_array().unwrap().iter();
        subsystems.map(|it| &it["subsystem"]).eq([42, 101])
    };
    other.said_until("tree", both).await;
}

#[tokio::test]
async fn who_has_not_taken_control_is_told_so_and_moves_nothing() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    assert_eq!(page.drive(1.0).await.unwrap_err(), "take control first");
    for request in [
        json!({"type": "resume"}),
        json!({"type": "standby"}),
        json!({"type": "take_over"}),
    ] {
        let refused = page.ask(request).await.unwrap_err();
        assert_eq!(refused, "take control first");
    }
    let refused = page
        .ask(json!({"type": "destination", "x": 1, "y": 1}))
        .await;
    assert_eq!(refused.unwrap_err(), "the vehicle has no planner");
    assert_eq!(scene.speed(), 0.0);
}

#[tokio::test]
async fn a_vehicle_is_driven_while_the_page_says_so_and_stops_300_ms_after_its_last_word() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    page.until(|state| state["drive"]["active"] == true).await;
    let state = page.until(|state| driver_of(state)["ours"] == true).await;
    assert_eq!(driver_of(&state)["authority"], 200);
    // The page is silent from now on.
    scene.until(|scene| scene.speed() == 0.0).await;
    page.until(|state| state["drive"]["active"] == false).await;
}

#[tokio::test]
async fn a_vehicle_stops_when_the_page_is_gone() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    drop(page);
    scene.until(|scene| scene.speed() == 0.0).await;
}

#[tokio::test]
async fn standby_and_giving_back_control_stop_the_vehicle() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    for request in [
        json!({"type": "standby"}),
        json!({"type": "control", "on": false}),
    ] {
        page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
        page.ask(request).await.unwrap();
        scene.until(|scene| scene.speed() == 0.0).await;
        page.drive(1.0).await.unwrap_err();
        page.ask(json!({"type": "control", "on": true}))
            .await
            .unwrap();
        page.ask(json!({"type": "resume"})).await.unwrap();
    }
}

#[tokio::test]
async fn an_emergency_needs_no_control_and_ends_only_when_it_is_cleared() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    let mut other = scene.page().await;
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    for _ in 0..2 {
        other
            .ask(json!({"type": "emergency", "on": true}))
            .await
            .unwrap();
    }
    scene.until(|scene| scene.speed() == 0.0).await;
    driver
        .until(|state| state["vehicle"]["emergency"] == true)
        .await;
    let refused = driver.drive(1.0).await.unwrap_err();
    assert!(refused.contains("emergency"), "{refused}");
    let refused = driver.ask(json!({"type": "resume"})).await;
    refused.unwrap_err();

    other
        .ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    driver
        .until(|state| state["vehicle"]["emergency"] == false)
        .await;
    let refused = driver.drive(1.0).await.unwrap_err();
    assert!(refused.contains("resume"), "not by itself: {refused}");
    driver.until(|state| state["control"]["held"] == true).await;
    driver.ask(json!({"type": "resume"})).await.unwrap();
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
}

/// A session asks for control again after pauses of its own. A part that is under control only after Resume
/// is made ready too, instead of standing by for good behind a vehicle that says it is ready.
#[tokio::test]
async fn resume_reaches_parts_that_are_under_control_later_than_others() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.ask(json!({"type": "emergency", "on": true}))
        .await
        .unwrap();
    page.until(|state| driver_of(state)["state"] == "emergency")
        .await;
    let _planner = planner(&scene, Arc::default());
    page.until(|state| planner_of(state)["state"] == "emergency")
        .await;
    page.ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    page.until(|state| state["vehicle"]["emergency"] == false && state["control"]["held"] == true)
        .await;
    page.ask(json!({"type": "resume"})).await.unwrap();
    page.until(|state| planner_of(state)["state"] == "ready")
        .await;
}

#[tokio::test]
async fn of_two_pages_one_has_the_vehicle_and_the_other_is_told_who() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    let mut other = scene.page().await;
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    let name = format!("operator (page {})", driver.hello["page"]);
    let refusal = format!("{name} controls vehicle 101");
    assert_eq!(other.drive(0.5).await.unwrap_err(), refusal);
    for request in [
        json!({"type": "control", "on": true}),
        json!({"type": "control", "on": false}),
        json!({"type": "standby"}),
        json!({"type": "resume"}),
        json!({"type": "take_over"}),
        json!({"type": "destination", "x": 1, "y": 1}),
        json!({"type": "stop"}),
    ] {
        assert_eq!(other.ask(request).await.unwrap_err(), refusal);
    }
    // It is not theirs to let go either.
    other.ask(json!({"type": "drive_end"})).await.unwrap();
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    let fleet = other.fleet_until(|fleet| fleet[0]["driver"] != "").await;
    assert_eq!(fleet[0]["driver"], name);
    let state = other.state().await;
    assert_eq!(state["control"]["page"], driver.hello["page"]);

    driver
        .ask(json!({"type": "control", "on": false}))
        .await
        .unwrap();
    other
        .ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
    other.ask(json!({"type": "resume"})).await.unwrap();
    other.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn the_vehicle_of_a_page_that_is_gone_is_stopped_and_free() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    let mut other = scene.page().await;
    driver
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    drop(driver);
    scene.until(|scene| scene.speed() == 0.0).await;
    other.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_page_that_connects_again_keeps_its_vehicle_although_its_old_connection_hangs() {
    let scene = Scene::new().await;
    let _second = scene.another_vehicle(102);
    let mut before = scene.page().await;
    before.select(102).await;
    before
        .until(|state| !state["vehicle"]["pose"].is_null())
        .await;
    before
        .ask(json!({"type": "control", "on": true}))
        .await
        .unwrap();
    let mut page = before.reopen(scene.address, 102).await;
    let state = page.until(|state| !state["vehicle"].is_null()).await;
    assert_eq!(state["vehicle"]["subsystem"], 102);
    page.ask(json!({"type": "resume"})).await.unwrap();
    page.drive(0.5).await.unwrap();
    // The old connection is ended.
    within_limit(async { while let Some(Ok(_)) = before.socket.next().await {} }).await;
}

#[tokio::test]
async fn a_page_cannot_take_the_vehicle_of_another_page_by_claiming_to_replace_it() {
    let scene = Scene::new().await;
    let mut driver = scene.driver().await;
    driver.drive(0.5).await.unwrap();
    // Both pages have the station's token, and each has a secret of its own.
    let other = scene.page().await;
    let own = other.hello["secret"].as_str().unwrap().to_owned();
    assert_ne!(driver.hello["secret"], other.hello["secret"]);
    for secret in ["", "0123456789abcdef0123456789abcdef", &own] {
        let mut thief = driver.replace(scene.address, 101, secret).await;
        thief.until(|state| !state["vehicle"].is_null()).await;
        let refused = thief.drive(0.5).await.unwrap_err();
        assert!(refused.contains("controls vehicle"), "{refused}");
    }
    driver.drive(0.5).await.unwrap();
}

#[tokio::test]
async fn a_setpoint_by_an_old_picture_is_refused_and_stops_the_vehicle() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    // The page goes on sending, but does not see anything new.
    let push = page.push(0.5);
    let (seq, at) = (push["seen"].as_u64().unwrap(), Instant::now());
    while at.elapsed() < Duration::from_millis(900) {
        let held = at.elapsed().as_millis();
        let frame = Message::text(format!("[{seq},{held},0.5,0]"));
        page.socket.send(frame).await.unwrap();
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    scene.until(|scene| scene.speed() == 0.0).await;
    let state = page.until(|state| state["drive"]["reason"] != "").await;
    let reason = state["drive"]["reason"].as_str().unwrap();
    assert!(reason.contains("picture"), "{reason}");
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_setpoint_that_names_no_picture_does_not_drive() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    for request in [
        json!({"type": "drive", "forward": 0.5, "turn": 0}),
        json!({"type": "drive", "forward": 0.5, "turn": 0, "seen": 1_000_000, "held_ms": 0}),
        json!({"type": "drive", "forward": 0.5, "turn": 0, "seen": 0, "held_ms": 1_000_000}),
    ] {
        let refused = page.ask(request).await.unwrap_err();
        assert!(refused.contains("not confirmed what it shows"), "{refused}");
    }
    assert_eq!(scene.speed(), 0.0);
}

#[tokio::test]
async fn a_page_gets_the_next_state_when_it_has_confirmed_the_last_and_learns_of_the_links() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    let is_known = |link: &serde_json::Value| {
        link["way_back"] == true
            && link["round_trip_ms"].is_u64()
            && link["vehicle_round_trip_ms"].is_u64()
    };
    page.said_until("link", is_known).await;
    let unconfirmed = loop {
        let said = page.next_unconfirmed().await;
        if said["type"] == "state" {
            break said;
        }
    };
    let waited = tokio::time::timeout(Duration::from_millis(500), page.next_unconfirmed());
    let early = waited.await;
    assert!(early.is_err(), "{early:?}");
    page.say(&json!([unconfirmed["seq"]])).await;
    assert!(page.state().await["seq"].as_u64() > unconfirmed["seq"].as_u64());
}

#[tokio::test]
async fn a_state_says_what_has_changed_and_with_those_before_it_all_that_there_is() {
    /// Octets of a state while a vehicle drives: a slow link carries stops and confirmations, too.
    const SHORT: usize = 400;
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    for _ in 0..10 {
        page.drive(0.5).await.unwrap();
        page.state().await;
        assert!(page.length < SHORT, "{} octets", page.length);
    }
    let mut other = scene.page().await;
    let whole = other.state().await;
    assert!(other.length > 2 * SHORT, "{} octets", other.length);
    let same = page.until(|state| state["seq"].as_u64() >= whole["seq"].as_u64());
    assert_eq!(same.await, whole);
}

#[tokio::test]
async fn an_emergency_of_one_station_is_cleared_by_no_other() {
    let scene = Scene::new().await;
    let _driver = scene.driver().await;
    let (address, station, _node) = scene.another_station(200).await;
    let mut other = Page::open(address).await;
    other
        .until(|state| driver_of(state)["controller"] == "42.1.1")
        .await;
    // Any client may set an emergency; only the client that set it may clear it.
    other
        .ask(json!({"type": "emergency", "on": true}))
        .await
        .unwrap();
    let mut first = scene.page().await;
    first
        .until(|state| state["vehicle"]["emergency"] == true)
        .await;
    let refused = first.ask(json!({"type": "emergency", "on": false})).await;
    assert!(refused.unwrap_err().contains("another client"));
    other
        .ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    first
        .until(|state| state["vehicle"]["emergency"] == false)
        .await;
    station.abort();
}

#[tokio::test]
async fn a_vehicle_that_starts_again_is_taken_and_made_ready_again() {
    // With control that is renewed beyond the end of the first component, and with control that
    // times out.
    for timeout in [0, 2] {
        let mut scene = Scene::with(Station::default(), timeout).await;
        let mut page = scene.driver().await;
        scene.restart_rover().await;
        page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
        page.ask(json!({"type": "drive_end"})).await.unwrap();
        scene.until(|scene| scene.speed() == 0.0).await;
    }
}

#[tokio::test]
async fn another_vehicle_can_be_chosen_if_there_is_one() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.ask(json!({"type": "select", "subsystem": 101}))
        .await
        .unwrap();
    for nobody in [42, 77] {
        let refused = page
            .ask(json!({"type": "select", "subsystem": nobody}))
            .await;
        assert!(refused.unwrap_err().contains("not a known vehicle"));
    }
    assert_eq!(page.state().await["vehicle"]["subsystem"], 101);
}
