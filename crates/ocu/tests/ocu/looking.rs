//! Pages show the map of the vehicle's world.

use std::path::Path;

use jaus_ocu::Station;
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::parts::{KnowledgeStore, Part};
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::scene::Scene;

#[tokio::test]
async fn the_map_of_the_store_is_shown_with_all_its_cells() {
    let scene = Scene::with(Station::default(), 0).await;
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ocu-map.redb");
    // Left over from an earlier run.
    let _ = std::fs::remove_file(&file);
    let (raster, picture) = KnowledgeStore::demo_map();
    let store = KnowledgeStore {
        file,
        map: Some((raster, picture.clone())),
        ..KnowledgeStore::default()
    };
    let running = tokio::spawn(store.run(scene.slot(61)));
    let mut page = scene.page().await;
    let state = page.until(|state| !state["map"].is_null()).await;
    let map = &state["map"];
    assert_eq!(map["name"], "traversability");
    assert_eq!((&map["rows"], &map["columns"]), (&json!(16), &json!(16)));
    for _ in 0..2 {
        let path = format!("/map/101/{}?revision={}", map["id"], map["revision"]);
        let (head, cells) = get(&scene, &path).await;
        assert!(head.starts_with("http/1.1 200"), "{head}");
        assert!(head.contains("content-length: 256"), "{head}");
        assert_eq!(cells, picture.cells);
    }
    let (head, _) = get(&scene, "/map/101/999").await;
    assert!(head.starts_with("http/1.1 404"), "{head}");
    running.abort();
}

/// Sends a GET request. Returns the head of the response in lower case, and its body.
async fn get(scene: &Scene, path: &str) -> (String, Vec<u8>) {
    let mut stream = TcpStream::connect(scene.address).await.unwrap();
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    within_limit(stream.read_to_end(&mut answer)).await.unwrap();
    let end = answer.windows(4).position(|it| it == b"\r\n\r\n").unwrap();
    let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
    (head, answer[end + 4..].to_vec())
}
