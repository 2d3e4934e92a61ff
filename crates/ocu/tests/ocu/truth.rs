//! Pages learn what a vehicle does and why: its surroundings, whether it is at rest, and the log of
//! events.

use jaus::component::{AccessControl, Component, Handlers, Kind, Management};
use jaus::messages::mobility::set_local_operating_zone::{LocalPolygonPointRec, X, Y};
use jaus::messages::mobility::{
    DeleteZone, QueryExcursion, QueryLocalOperatingZone, QueryVelocityState, QueryVelocityStateExt,
    QueryWrenchEffort, ReportLocalOperatingZone, ReportVelocityState, SetLocalOperatingZone,
    SetWrenchEffort, local_operating_zone, primitive_driver, velocity_state_sensor,
};
use jaus_ocu::{Station, Token};
use jaus_vehicle::ground::RangeSensor;
use jaus_vehicle::sensing::{RangerConfig, Ray, Scan};
use serde_json::{Value, json};
use std::time::{Duration, SystemTime};

use crate::scene::{Page, Scene};

async fn fetched(scene: &Scene, path: &str) -> Value {
    let (head, body) = scene.get(path, "").await;
    assert!(head.starts_with("http/1.1 200"), "{head}");
    serde_json::from_slice(&body).unwrap()
}

/// What lies over the map of a vehicle, for a page that has the zones of a revision.
async fn overlay_of(page: &mut Page, vehicle: u16, zones: u64) -> Value {
    page.say(&json!({"type": "overlay", "vehicle": vehicle, "zones": zones}))
        .await;
    page.said("overlay").await["overlay"].take()
}

/// A store with an operating zone of 40 m around the origin.
fn zones(scene: &Scene) -> Component {
    let corner = |x: f64, y: f64| LocalPolygonPointRec {
        x: X::new(x).unwrap(),
        y: Y::new(y).unwrap(),
        min_z_position: None,
        max_z_position: None,
    };
    let report = ReportLocalOperatingZone {
        local_operating_zone: vec![
            corner(-20.0, -20.0),
            corner(-20.0, 20.0),
            corner(20.0, 20.0),
            corner(20.0, -20.0),
        ],
        ..ReportLocalOperatingZone::default()
    };
    let service = Handlers::new(local_operating_zone::LATEST)
        .answer(move |_: QueryLocalOperatingZone| report.clone())
        .command(|_: SetLocalOperatingZone, _, _| {})
        .command(|_: DeleteZone, _, _| {})
        .declines::<QueryExcursion>()
        .on_stop(|_| {});
    scene.attach(
        61,
        Component::builder(Kind::Vehicle, "Rover")
            .management(Management::new())
            .offer(service),
    )
}

#[tokio::test]
async fn a_page_gets_the_zones_once_and_the_points_that_the_range_sensor_sees() {
    let scene = Scene::new().await;
    let _zones = zones(&scene);
    let sensor = RangeSensor::new(RangerConfig::default(), 10.0);
    let ahead = |degrees: i32| Ray {
        bearing: f64::from(degrees).to_radians(),
        range: 2.0,
    };
    sensor.publish(Some(&Scan::new((-45..=45).map(ahead))), SystemTime::now());
    let builder = Component::builder(Kind::Vehicle, "Rover").access_control(AccessControl::new());
    let _sensor = scene.attach(54, builder.offer(sensor.service()));
    let mut page = scene.page().await;
    page.select(101).await;
    let revision = |state: &Value, of: &str| state["vehicle"]["overlay"][of].as_u64();
    let state = page
        .until(|it| revision(it, "zones") > Some(0) && revision(it, "scan") > Some(0))
        .await;
    assert!(state["vehicle"]["overlay"]["scan_age_ms"].as_u64() < Some(5000));
    let overlay = overlay_of(&mut page, 101, 0).await;
    assert_eq!(overlay["zones"][0]["number"], 1);
    assert_eq!(overlay["zones"][0]["points"][2], json!([20.0, 20.0]));
    let points = overlay["scan"].as_array().unwrap();
    assert!(points.len() > 80, "{}", points.len());
    let (x, y) = (
        points[0][0].as_f64().unwrap(),
        points[0][1].as_f64().unwrap(),
    );
    assert!((x.hypot(y) - 2.0).abs() < 0.3, "{x} {y}");
    assert!(!overlay["obstacles"].as_array().unwrap().is_empty());

    let known = overlay["zones_revision"].as_u64().unwrap();
    let again = overlay_of(&mut page, 101, known).await;
    assert_eq!(again["zones"], Value::Null, "the page has them");
    assert_eq!(overlay_of(&mut page, 999, 0).await, Value::Null);
}

#[tokio::test]
async fn the_overlay_and_the_log_need_the_token_where_the_map_needs_it() {
    let station = Station {
        token: Some(Token::new("correct-horse-battery").unwrap()),
        token_to_read: true,
        ..Station::default()
    };
    let scene = Scene::with(station, 0).await;
    let (head, _) = scene.get("/events", "").await;
    assert!(head.starts_with("http/1.1 401"), "{head}");
    let mut page = scene.page().await;
    let refused = page.ask(json!({"type": "overlay", "vehicle": 101})).await;
    assert!(refused.unwrap_err().contains("token"));
    let token = "Authorization: Bearer correct-horse-battery\r\n";
    let (head, _) = scene.get("/events", token).await;
    assert!(head.starts_with("http/1.1 200"), "{head}");
}

/// A vehicle whose components obey, and whose motor does not.
fn runaway(scene: &Scene) -> Component {
    let driver = Handlers::new(primitive_driver::LATEST)
        .command(|_: SetWrenchEffort, _, _| {})
        .declines::<QueryWrenchEffort>()
        .on_stop(|_| {});
    let speed = Handlers::new(velocity_state_sensor::LATEST)
        .answer(|_: QueryVelocityState| {
            let mut report = ReportVelocityState::default();
            report.set_velocity_x_m_per_s(0.8).unwrap();
            report
        })
        .declines::<QueryVelocityStateExt>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .management(Management::new())
        .offer(speed)
        .offer(driver);
    scene.attach(2, rover)
}

#[tokio::test]
async fn a_vehicle_that_confirms_the_emergency_and_moves_on_is_shown_as_a_runaway() {
    let mut scene = Scene::new().await;
    scene.end_rover();
    let _runaway = runaway(&scene);
    let mut page = scene.page().await;
    page.select(101).await;
    page.until(|it| it["vehicle"]["at_rest"] == false).await;
    page.ask(json!({"type": "emergency", "on": true}))
        .await
        .unwrap();
    let state = page.until(|it| it["vehicle"]["emergency"] == true).await;
    assert_eq!(state["vehicle"]["at_rest"], false, "the speed decides");
    page.until(|it| it["vehicle"]["runaway"] == true).await;
    let is_listed = |fleet: &Value| {
        let rover = &fleet[0];
        rover["runaway"] == true
            && rover["at_rest"] == false
            && rover["speed"].as_f64() > Some(0.79)
    };
    page.fleet_until(is_listed).await;
    let events = fetched(&scene, "/events?after=0").await;
    let texts = events["events"].to_string();
    for text in [
        "emergency stop requested by operator",
        "emergency reported, requested by operator",
        "the vehicle moves although it is in emergency",
    ] {
        assert!(texts.contains(text), "{text}: {texts}");
    }
}

#[tokio::test]
async fn a_vehicle_that_is_only_listed_tells_whether_it_is_at_rest() {
    let scene = Scene::new().await;
    let _other = scene.another_vehicle(102);
    let mut page = scene.page().await;
    page.select(101).await;
    let rests = |fleet: &Value| {
        let all = fleet.as_array().unwrap();
        let listed = |it: &&Value| it["at_rest"] == true;
        all.len() == 2 && all.iter().filter(listed).count() == 2
    };
    page.fleet_until(rests).await;
}

#[tokio::test]
async fn the_log_says_who_drove_and_why_it_ended_and_a_page_fetches_what_is_new() {
    let scene = Scene::new().await;
    let mut page = scene.driver().await;
    page.drive_until(&scene, |scene| scene.speed() > 0.3).await;
    // The page is silent from now on.
    page.until(|state| state["drive"]["reason"] != "").await;
    let events = loop {
        let events = fetched(&scene, "/events").await;
        if events["events"].to_string().contains("has stopped driving") {
            break events;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    let texts: Vec<_> = events["events"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["text"].as_str().unwrap())
        .collect();
    for text in ["operator has control", "operator drives"] {
        assert!(texts.contains(&text), "{text}: {texts:?}");
    }
    let ended = texts.iter().find(|it| it.contains("stopped driving"));
    assert!(
        ended.unwrap().contains("no command from the page"),
        "{texts:?}"
    );
    let latest = events["latest"].as_u64().unwrap();
    assert_eq!(page.state().await["events"], latest);
    let after = fetched(&scene, &format!("/events?after={latest}")).await;
    assert_eq!(after["events"], json!([]));
}
