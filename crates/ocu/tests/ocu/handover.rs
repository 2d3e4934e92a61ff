//! Handing over control between the stations of two operators.

use serde_json::{Value, json};

use crate::scene::{Page, Scene, driver_of};

fn control(on: bool) -> Value {
    json!({"type": "control", "on": on})
}

fn is_held(state: &Value) -> bool {
    state["control"]["held"] == true
}

/// Whether the station tells this about a handover.
fn tells(state: &Value, words: &str) -> bool {
    let told = state["control"]["handover"].as_str();
    told.is_some_and(|told| told.contains(words))
}

/// A page that knows who controls the vehicle.
async fn page_of_other(address: std::net::SocketAddr) -> Page {
    let mut other = Page::open(address).await;
    other
        .until(|state| driver_of(state)["controller"] == "42.1.1")
        .await;
    other
}

/// Waits for the other operator's request and returns it.
async fn requested(page: &mut Page) -> Value {
    let is_requested = |state: &Value| state["control"]["requests"][0]["operator"] == "43.1.1";
    let mut state = page.until(is_requested).await;
    assert_eq!(state["control"]["requests"][0]["authority"], 200);
    state["control"]["requests"][0].take()
}

/// The decision about a request.
fn decision(request: &Value, grant: bool) -> Value {
    let (part, operator) = (&request["part"], &request["operator"]);
    json!({"type": "handover", "part": part, "operator": operator, "grant": grant})
}

#[tokio::test]
async fn a_higher_authority_takes_over_the_vehicle_stops_and_both_see_it() {
    let scene = Scene::new().await;
    let mut first = scene.driver().await;
    let (address, _station, _node) = scene.another_station(250).await;
    let mut second = page_of_other(address).await;
    first.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    second.ask(control(true)).await.unwrap();
    scene.until(|scene| scene.speed() == 0.0).await;
    let state = first
        .until(|state| tells(state, "43.1.1 has taken control with authority 250"))
        .await;
    assert_eq!(state["control"]["wanted"], false);
    first.drive(0.5).await.unwrap_err();

    second
        .until(|state| is_held(state) && driver_of(state)["state"] == "standby")
        .await;
    second.ask(json!({"type": "resume"})).await.unwrap();
    second
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
    second.ask(control(false)).await.unwrap();
    // The first operator gets control when that operator asks for it, not before.
    first
        .until(|state| driver_of(state)["controller"].is_null())
        .await;
    first.ask(control(true)).await.unwrap();
    first.until(is_held).await;
}

#[tokio::test]
async fn an_equal_authority_asks_and_a_grant_stops_the_vehicle_and_hands_it_over() {
    let scene = Scene::new().await;
    let mut first = scene.driver().await;
    let (address, _station, _node) = scene.another_station(200).await;
    let mut second = page_of_other(address).await;
    second.ask(control(true)).await.unwrap();
    let state = second
        .until(|state| state["control"]["asking"] == "42.1.1")
        .await;
    assert!(!is_held(&state), "not yet");
    let request = requested(&mut first).await;
    first.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    // A decision about another operator's request decides nothing about this one.
    let mut other = decision(&request, true);
    other["operator"] = json!("44.1.1");
    let over = first.ask(other).await.unwrap_err();
    assert_eq!(over, "the request for control is over");
    first.ask(decision(&request, true)).await.unwrap();
    scene.until(|scene| scene.speed() == 0.0).await;
    let state = second.until(is_held).await;
    assert!(tells(&state, "42.1.1 has handed over control"), "{state}");
    first
        .until(|state| tells(state, "handed over to 43.1.1") && !is_held(state))
        .await;
    let refused = second.drive(0.5).await.unwrap_err();
    assert!(refused.contains("resume first"), "{refused}");
    second.ask(json!({"type": "resume"})).await.unwrap();
    second
        .drive_until(&scene, |scene| scene.speed() > 0.3)
        .await;
}

#[tokio::test]
async fn a_refusal_is_seen_by_the_operator_who_asked_and_changes_nothing() {
    let scene = Scene::new().await;
    let mut first = scene.driver().await;
    let (address, _station, _node) = scene.another_station(200).await;
    let mut second = page_of_other(address).await;
    second.ask(control(true)).await.unwrap();
    let request = requested(&mut first).await;
    let answer = decision(&request, false);
    first.ask(answer.clone()).await.unwrap();
    let state = second
        .until(|state| tells(state, "42.1.1 has refused to hand over control"))
        .await;
    assert_eq!(state["control"]["asking"], Value::Null);
    assert!(!is_held(&state));
    let again = first.ask(answer).await.unwrap_err();
    assert_eq!(again, "the request for control is over");
    first.drive_until(&scene, |scene| scene.speed() > 0.3).await;
}

#[tokio::test]
async fn a_request_that_is_withdrawn_disappears_at_the_operator_in_control() {
    let scene = Scene::new().await;
    let mut first = scene.driver().await;
    let (address, _station, _node) = scene.another_station(200).await;
    let mut second = page_of_other(address).await;
    second.ask(control(true)).await.unwrap();
    requested(&mut first).await;
    second.ask(control(false)).await.unwrap();
    let state = first
        .until(|state| state["control"]["requests"] == json!([]))
        .await;
    assert!(is_held(&state));
}

#[tokio::test]
async fn the_operator_who_asked_gets_control_when_the_other_station_ends() {
    let scene = Scene::new().await;
    let mut first = scene.driver().await;
    let (address, _station, _node) = scene.another_station(200).await;
    let mut second = page_of_other(address).await;
    second.ask(control(true)).await.unwrap();
    requested(&mut first).await;
    first.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    scene.end_station();
    scene.until(|scene| scene.speed() == 0.0).await;
    second.until(is_held).await;
}

#[tokio::test]
async fn a_vehicle_that_passes_on_no_requests_is_named_with_the_operator_in_control() {
    let scene = Scene::new().await;
    let _vehicles = scene.unmoving_vehicles(102..103);
    let (address, _station, _node) = scene.another_station(200).await;
    let select = json!({"type": "select", "subsystem": 102});
    let mut pages = [scene.page().await, Page::open(address).await];
    for page in &mut pages {
        let listed = |fleet: &Value| fleet[1]["state"] == "standby";
        page.fleet_until(listed).await;
        page.ask(select.clone()).await.unwrap();
    }
    let [first, second] = &mut pages;
    first.ask(control(true)).await.unwrap();
    second
        .until(|state| driver_of(state)["controller"] == "42.1.1")
        .await;
    let refused = second.ask(control(true)).await.unwrap_err();
    assert!(refused.contains("42.1.1 is in control"), "{refused}");
    assert!(refused.contains("does not pass on requests"), "{refused}");
}
