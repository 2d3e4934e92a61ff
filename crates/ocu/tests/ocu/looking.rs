//! Pages show the map of the vehicle's world.

use std::path::Path;

use jaus_ocu::Station;
use jaus_vehicle::parts::{KnowledgeStore, Part};
use serde_json::json;

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
        let (head, cells) = scene.get(&path, "").await;
        assert!(head.starts_with("http/1.1 200"), "{head}");
        assert!(head.contains("content-length: 256"), "{head}");
        assert_eq!(cells, picture.cells);
    }
    let (head, _) = scene.get("/map/101/999", "").await;
    assert!(head.starts_with("http/1.1 404"), "{head}");
    running.abort();
}
