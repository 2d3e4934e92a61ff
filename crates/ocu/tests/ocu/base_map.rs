//! The map file behind the vehicle: its tiles for pages, and the place of the local frame.

use std::path::PathBuf;

use jaus::component::{AccessControl, Component, Kind};
use jaus_ocu::{BaseMap, Station, Token};
use jaus_test_kit::map_file::{GZIP, MapFile, PNG, VECTOR, gzip, png};
use serde_json::{Value, json};

use crate::scene::Scene;

const TOKEN: &str = "correct-horse-battery";

fn opened(name: &str, file: &MapFile) -> BaseMap {
    let path: PathBuf = [env!("CARGO_TARGET_TMPDIR"), name].iter().collect();
    std::fs::write(&path, file.encode()).unwrap();
    BaseMap::open(&path).unwrap()
}

async fn with(base_map: Option<BaseMap>) -> Scene {
    let station = Station {
        base_map,
        ..Station::default()
    };
    Scene::with(station, 0).await
}

#[tokio::test]
async fn pages_get_the_description_and_the_tiles_of_the_map_file() {
    let file = MapFile {
        zooms: (0, 4),
        ..MapFile::new(PNG)
    };
    let red = png([255, 0, 0]);
    let scene = with(Some(opened(
        "pictures.pmtiles",
        &file.tile((4, 8, 5), &red),
    )))
    .await;
    assert_eq!(scene.page().await.hello["base_map"], true);
    let (head, body) = scene.get("/base-map", "").await;
    assert!(head.starts_with("http/1.1 200"), "{head}");
    let description: Value = serde_json::from_slice(&body).unwrap();
    assert_eq!(description["attribution"], "© Testers");
    assert_eq!(
        (&description["min_zoom"], &description["max_zoom"]),
        (&json!(0), &json!(4))
    );
    let (head, body) = scene.get("/base-map/4/8/5", "").await;
    assert!(head.starts_with("http/1.1 200"), "{head}");
    assert!(head.contains("content-type: image/png"), "{head}");
    assert!(!head.contains("content-encoding"), "{head}");
    assert_eq!(body, red);
    for (path, status) in [
        ("4/8/6", 204),
        ("4/16/0", 204),
        ("5/0/0", 204),
        ("256/0/0", 400),
    ] {
        let (head, _) = scene.get(&format!("/base-map/{path}"), "").await;
        assert!(
            head.starts_with(&format!("http/1.1 {status}")),
            "{path}: {head}"
        );
    }
}

#[tokio::test]
async fn a_compressed_tile_is_sent_compressed_to_a_client_that_takes_it() {
    let file = MapFile {
        compression: GZIP,
        ..MapFile::new(VECTOR)
    };
    let (stored, damaged) = (gzip(b"roads"), b"\x1f\x8bnothing");
    let file = file.tile((0, 0, 0), &stored).tile((1, 0, 0), damaged);
    let scene = with(Some(opened("vectors.pmtiles", &file))).await;
    let tile = "/base-map/0/0/0";
    let (head, body) = scene.get(tile, "Accept-Encoding: br, gzip;q=0.8\r\n").await;
    assert!(head.contains("content-encoding: gzip"), "{head}");
    assert!(
        head.contains("content-type: application/vnd.mapbox-vector-tile"),
        "{head}"
    );
    assert_eq!(body, stored);
    for encodings in ["", "Accept-Encoding: gzip;q=0, br\r\n"] {
        let (head, body) = scene.get(tile, encodings).await;
        assert!(!head.contains("content-encoding"), "{head}");
        assert_eq!(body, b"roads");
    }
    let (head, body) = scene.get("/base-map/1/0/0", "").await;
    assert!(head.starts_with("http/1.1 500"), "{head}");
    let words = String::from_utf8(body).unwrap();
    assert!(words.contains("its tiles are damaged"), "{words}");
}

#[tokio::test]
async fn the_map_file_follows_the_rules_of_access() {
    let file = MapFile::new(PNG).tile((0, 0, 0), b"world");
    let station = Station {
        base_map: Some(opened("guarded.pmtiles", &file)),
        token: Token::new(TOKEN),
        token_to_read: true,
        ..Station::default()
    };
    let scene = Scene::with(station, 0).await;
    for path in ["/base-map", "/base-map/0/0/0"] {
        let (head, _) = scene.get(path, "").await;
        assert!(head.starts_with("http/1.1 401"), "{head}");
        let token = format!("Authorization: Bearer {TOKEN}\r\n");
        let (head, _) = scene.get(path, &token).await;
        assert!(head.starts_with("http/1.1 200"), "{head}");
        let (head, _) = scene.get(path, "Origin: http://evil.example\r\n").await;
        assert!(head.starts_with("http/1.1 403"), "{head}");
    }
    let scene = with(None).await;
    assert_eq!(scene.page().await.hello["base_map"], false);
    let (head, _) = scene.get("/base-map", "").await;
    assert!(head.starts_with("http/1.1 404"), "{head}");
}

#[tokio::test]
async fn the_local_frame_has_a_place_once_a_global_pose_is_reported() {
    let scene = Scene::new().await;
    let mut page = scene.page().await;
    let state = page
        .until(|state| !state["vehicle"]["pose"].is_null())
        .await;
    assert!(state["vehicle"]["place"].is_null(), "{state:#}");
    let sensor = Component::builder(Kind::Vehicle, "Rover").access_control(AccessControl::new());
    let sensor = sensor.offer(scene.vehicle.global_pose_sensor());
    let _sensor = scene.attach(43, sensor);
    let state = page
        .until(|state| !state["vehicle"]["place"].is_null())
        .await;
    let place = &state["vehicle"]["place"];
    // The simulation begins there, heading north.
    for (value, expected) in [("latitude", 52.5), ("longitude", 13.4), ("heading", 0.0)] {
        let found = place[value].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-4, "{value}: {found}");
    }
    assert!((place["fix"]["latitude"].as_f64().unwrap() - 52.5).abs() < 1e-5);
}
