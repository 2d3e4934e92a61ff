//! The connections that carry nothing but stops.

use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use jaus::component::State;
use jaus_ocu::{Station, Token};
use jaus_test_kit::waiting::within_limit;
use serde_json::json;
use tokio::time::timeout;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::{ClientRequestBuilder, Message};

use crate::scene::{Page, Scene, Socket, driver_of};

async fn stops(scene: &Scene) -> Socket {
    let url = format!("ws://{}/stop", scene.address);
    within_limit(connect_async(url)).await.unwrap().0
}

/// Sends a frame. Returns the next that is not empty.
async fn say(socket: &mut Socket, text: &str) -> String {
    socket.send(Message::text(text)).await.unwrap();
    loop {
        match within_limit(socket.next()).await {
            Some(Ok(Message::Text(answer))) if answer.is_empty() => {}
            Some(Ok(Message::Text(answer))) => return answer.to_string(),
            Some(Ok(Message::Ping(_))) => {}
            Some(Ok(Message::Close(Some(frame)))) => return frame.reason.to_string(),
            other => panic!("{other:?}"),
        }
    }
}

fn emergency(scene: &Scene) -> bool {
    let rover = scene.rover.as_ref().unwrap();
    rover.standing().state == State::Emergency
}

#[tokio::test]
async fn a_stop_acts_without_waiting_for_anything_that_the_page_has_sent_before() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    let start = Instant::now();
    assert_eq!(say(&mut socket, "stop 101").await, "ok 101");
    assert!(start.elapsed() < Duration::from_secs(1));
    scene
        .until(|scene| emergency(scene) && scene.speed() == 0.0)
        .await;
    for _ in 0..3 {
        assert_eq!(say(&mut socket, "stop 101").await, "ok 101", "repeated");
    }
    page.ask(json!({"type": "emergency", "on": false}))
        .await
        .unwrap();
    scene.until(|scene| !emergency(scene)).await;
}

#[tokio::test]
async fn a_late_copy_of_a_stop_that_its_page_has_cleared_stops_nothing() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    let mut page = scene.driver().await;
    for (stop, clear, answer, first) in [
        ("stop 101", "emergency", "ok 101", 1),
        ("stop-all", "emergency_all", "ok all", 3),
    ] {
        let pressed = |press: u32| format!("{stop} 7.{press}");
        let taken = say(&mut socket, &pressed(first)).await;
        assert!(
            taken.starts_with(&format!("{answer} 7.{first} ")),
            "{taken}"
        );
        scene.until(emergency).await;
        page.ask(json!({"type": clear, "on": false, "press": [7, first]}))
            .await
            .unwrap();
        scene.until(|scene| !emergency(scene)).await;
        let late = say(&mut socket, &pressed(first)).await;
        let cleared = answer.replace("ok", "cleared");
        assert_eq!(late, format!("{cleared} 7.{first}"), "a late copy");
        page.ask(json!({"type": "standby"})).await.unwrap();
        assert!(!emergency(&scene), "{stop}");
        for new in [&pressed(first + 1), stop] {
            let taken = say(&mut socket, new).await;
            assert!(taken.starts_with(answer), "a new one: {taken}");
            scene.until(emergency).await;
            page.ask(json!({"type": clear, "on": false})).await.unwrap();
            scene.until(|scene| !emergency(scene)).await;
        }
    }
}

#[tokio::test]
async fn a_copy_of_a_stop_that_another_page_has_cleared_stops_nothing() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut socket = stops(&scene).await;
    let mut page = scene.driver().await;
    for (stop, copy) in [
        ("stop 101 7.1", "cleared 101 7.1"),
        ("stop-all 7.2", "ok all 7.2 2"),
    ] {
        say(&mut socket, stop).await;
        scene.until(emergency).await;
        let known = page.until(|it| it["vehicle"]["emergency"] == true).await;
        let clear =
            json!({"type": "emergency", "on": false, "press": [8, 0], "stops": known["stops"]});
        page.ask(clear).await.unwrap();
        scene.until(|scene| !emergency(scene)).await;
        // The page that has pressed has not heard of it, and goes on.
        assert_eq!(say(&mut socket, stop).await, copy);
        page.ask(json!({"type": "standby"})).await.unwrap();
        assert!(!emergency(&scene), "{stop}");
    }
    assert_eq!(second.rover.standing().state, State::Emergency);
    say(&mut socket, "stop-all 7.3").await;
    scene.until(emergency).await;
}

#[tokio::test]
async fn a_page_of_an_older_station_is_refused_and_can_still_stop() {
    let scene = Scene::new().await;
    for (path, is_open) in [("ws", false), ("stop", true)] {
        let url = format!("ws://{}/{path}", scene.address).parse().unwrap();
        let request = ClientRequestBuilder::new(url).with_sub_protocol("jaus");
        // As in a browser, it fails if the station has chosen none of what it names.
        assert_eq!(within_limit(connect_async(request)).await.is_ok(), is_open);
    }
}

#[tokio::test]
async fn a_late_request_to_clear_does_not_undo_a_later_stop() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    let mut page = scene.driver().await;
    assert_eq!(say(&mut socket, "stop 101 7.5").await, "ok 101 7.5 1");
    assert_eq!(say(&mut socket, "stop 101 7.6").await, "ok 101 7.6 2");
    scene.until(emergency).await;
    for clear in ["emergency", "emergency_all"] {
        let late = page.ask(json!({"type": clear, "on": false, "press": [7, 5]}));
        let refused = late.await.unwrap_err();
        assert!(refused.contains("stopped again"), "{refused}");
        // By the next answer, the vehicle would have cleared it.
        let _ = page.ask(json!({"type": "standby"})).await;
        assert!(emergency(&scene));
    }
    page.ask(json!({"type": "emergency", "on": false, "press": [7, 6]}))
        .await
        .unwrap();
    scene.until(|scene| !emergency(scene)).await;
}

#[tokio::test]
async fn who_clears_a_stop_of_another_page_has_seen_it() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    let mut page = scene.driver().await;
    assert_eq!(page.state().await["stops"], 0);
    for (stop, answer) in [
        ("stop 101 7.5", "ok 101 7.5 1"),
        ("stop 101", "ok 101"),
        ("stop-all", "ok all"),
    ] {
        let before = page.state().await["stops"].as_u64().unwrap();
        assert_eq!(say(&mut socket, stop).await, answer);
        scene.until(emergency).await;
        for clear in ["emergency", "emergency_all"] {
            let known = json!({"type": clear, "on": false, "press": [8, 0], "stops": before});
            let refused = page.ask(known).await.unwrap_err();
            assert!(refused.contains("stopped again"), "{refused}");
        }
        let shown = page.until(|it| it["stops"].as_u64() > Some(before)).await;
        assert!(emergency(&scene));
        let known =
            json!({"type": "emergency_all", "on": false, "press": [8, 0], "stops": shown["stops"]});
        page.ask(known).await.unwrap();
        scene.until(|scene| !emergency(scene)).await;
    }
}

#[tokio::test]
async fn all_vehicles_are_stopped_by_one_frame() {
    let scene = Scene::new().await;
    let second = scene.another_vehicle(102);
    let mut page = scene.page().await;
    page.select(102).await;
    let mut socket = stops(&scene).await;
    assert_eq!(say(&mut socket, "stop-all").await, "ok all");
    scene
        .until(|scene| emergency(scene) && second.rover.standing().state == State::Emergency)
        .await;
}

#[tokio::test]
async fn a_vehicle_of_the_settings_that_is_stopped_before_it_is_there_is_stopped_when_it_comes() {
    for (stop, answer) in [("stop-all", "ok all"), ("stop 102", "no ")] {
        let station = Station {
            vehicles: vec![101, 102],
            ..Station::default()
        };
        let scene = Scene::with(station, 0).await;
        let mut socket = stops(&scene).await;
        let said = say(&mut socket, stop).await;
        assert!(said.starts_with(answer), "{said}");
        let late = scene.another_vehicle(102);
        scene
            .until(|_| late.rover.standing().state == State::Emergency)
            .await;
    }
}

#[tokio::test]
async fn the_emergency_of_another_client_is_cleared_only_by_a_station_with_that_right() {
    let clear_any = json!({"type": "clear_any_emergency"});
    let of_others = |state: &serde_json::Value| state["vehicle"]["emergency_of_others"] == true;
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    page.until(|state| driver_of(state)["state"] == "standby")
        .await;
    let (client, _node) = scene.client();
    client
        .set_emergency(scene.rover.as_ref().unwrap().id())
        .await
        .unwrap();
    page.until(of_others).await;
    // Over a link without keys a station has no such right.
    for request in [json!({"type": "emergency", "on": false}), clear_any.clone()] {
        let refused = page.ask(request).await.unwrap_err();
        assert!(
            refused.contains("another client set an emergency"),
            "{refused}"
        );
        assert!(refused.contains("clear-emergency=any"), "{refused}");
    }
    assert!(emergency(&scene));
    // On the vehicle's own node it has.
    let (address, _running) = scene.station_of_the_vehicle().await;
    let mut page = Page::open(address).await;
    page.until(of_others).await;
    page.ask(clear_any).await.unwrap();
    scene.until(|scene| !emergency(scene)).await;
}

#[tokio::test]
async fn a_stop_of_an_unknown_vehicle_is_refused_and_what_is_no_stop_ends_the_connection() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    assert!(say(&mut socket, "stop 77").await.starts_with("no "));
    for text in [
        "",
        "go 101",
        "stop",
        "stop 70000",
        "stop 101 and something more than 32 octets",
        r#"{"type":"control","on":true}"#,
    ] {
        let mut socket = stops(&scene).await;
        let reason = say(&mut socket, text).await;
        assert_eq!(reason, "stop SUBSYSTEM or stop-all", "{text}");
    }
}

#[tokio::test]
async fn where_looking_needs_the_token_stopping_needs_it_too() {
    const TOKEN: &str = "correct-horse-battery";
    for (to_read, may_stop) in [(true, false), (false, true)] {
        let station = Station {
            token: Token::new(TOKEN),
            token_to_read: to_read,
            ..Station::default()
        };
        let scene = Scene::with(station, 0).await;
        let mut page = scene.page().await;
        page.ask(json!({"type": "token", "token": TOKEN}))
            .await
            .unwrap();
        page.until(|state| driver_of(state)["state"] == "standby")
            .await;
        let mut socket = stops(&scene).await;
        let answer = say(&mut socket, "stop 101").await;
        assert_eq!(answer.starts_with("ok"), may_stop, "{answer}");
        assert_eq!(
            say(&mut stops(&scene).await, "token wrong").await,
            "wrong token"
        );
        let mut socket = stops(&scene).await;
        socket
            .send(Message::text(format!("token {TOKEN}")))
            .await
            .unwrap();
        assert_eq!(say(&mut socket, "stop 101").await, "ok 101");
    }
}

#[tokio::test]
async fn a_connection_for_stops_says_something_at_once_and_again_within_10_s() {
    let scene = Scene::new().await;
    let mut socket = stops(&scene).await;
    // A frame and a ping come at once.
    for _ in 0..3 {
        match timeout(Duration::from_secs(12), socket.next()).await {
            Ok(Some(Ok(Message::Text(_) | Message::Ping(_)))) => {}
            other => panic!("{other:?}"),
        }
    }
}
