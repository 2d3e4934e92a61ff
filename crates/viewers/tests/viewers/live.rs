//! The protocol as a well-behaved viewer sees it.

use jaus_test_kit::waiting::until;
use jaus_viewers::MOST_CHANNELS;
use serde_json::json;

use crate::scene::{Scene, TIME, Viewer};

#[tokio::test]
async fn a_viewer_gets_the_channels_and_the_samples_of_those_it_subscribes_to() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    scene.publish(&mut channels, "101.1.1", 0);
    let mut viewer = Viewer::connect(&scene).await;
    let info = viewer.text().await;
    assert_eq!(
        (&info["op"], &info["name"]),
        (&json!("serverInfo"), &json!("test"))
    );
    assert_eq!(info["capabilities"], json!([]));
    let advertised = viewer.text().await;
    let channel = &advertised["channels"][0];
    assert_eq!(channel["topic"], "/jaus/101/1/1/ReportStatus");
    assert_eq!(channel["encoding"], "json");
    assert_eq!(channel["schemaEncoding"], "jsonschema");
    let subscription = json!({ "id": 7, "channelId": channel["id"] });
    viewer
        .say(&json!({ "op": "subscribe", "subscriptions": [subscription] }))
        .await;
    let status = |reserved| json!({ "Status": 1, "Reserved": reserved });
    assert_eq!(viewer.sample().await, (7, TIME, status(0)), "the latest");
    scene.publish(&mut channels, "101.1.1", 3);
    assert_eq!(viewer.sample().await, (7, TIME + 3, status(3)));
}

#[tokio::test]
async fn a_viewer_that_subscribes_late_gets_the_latest_sample_once_with_its_original_time() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    let mut early = Viewer::connect(&scene).await;
    for reserved in [1, 2] {
        scene.publish(&mut channels, "101.1.1", reserved);
    }
    let latest = (7, TIME + 2, json!({ "Status": 1, "Reserved": 2 }));
    let new = (7, TIME + 3, json!({ "Status": 1, "Reserved": 3 }));
    let mut late = Viewer::subscribing(&scene).await;
    assert_eq!(late.sample().await, latest);
    let mut later = Viewer::subscribing(&scene).await;
    assert_eq!(later.sample().await, latest, "and not only the first");
    scene.publish(&mut channels, "101.1.1", 3);
    assert_eq!(late.sample().await, new);
    assert_eq!(later.sample().await, new);
    // To subscribe again is to ask again.
    let unsubscribe = json!({ "op": "unsubscribe", "subscriptionIds": [7] });
    late.say(&unsubscribe).await;
    let subscription = json!({ "id": 8, "channelId": 0 });
    late.say(&json!({ "op": "subscribe", "subscriptions": [subscription] }))
        .await;
    assert_eq!(late.sample().await, (8, new.1, new.2));
    // Those who have not subscribed get nothing.
    assert_eq!(early.text().await["op"], "serverInfo");
    assert_eq!(early.text().await["op"], "advertise");
    early.settle().await;
}

#[tokio::test]
async fn a_channel_that_opens_later_is_announced_and_unsubscribing_ends_the_samples() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    scene.publish(&mut channels, "101.1.1", 0);
    let mut viewer = Viewer::subscribed(&scene).await;
    let unsubscribe = json!({ "op": "unsubscribe", "subscriptionIds": [7] });
    viewer.say(&unsubscribe).await;
    viewer.settle().await;
    scene.publish(&mut channels, "101.1.1", 1);
    scene.publish(&mut channels, "101.1.2", 2);
    let advertised = viewer.text().await;
    let topic = &advertised["channels"][0]["topic"];
    assert_eq!(topic, "/jaus/101/1/2/ReportStatus", "and no sample before");
}

#[tokio::test]
async fn a_viewer_that_has_gone_is_forgotten() {
    let scene = Scene::new().await;
    let viewer = Viewer::connect(&scene).await;
    until(|| scene.sharing.clients() == 1).await;
    drop(viewer);
    until(|| scene.sharing.clients() == 0).await;
}

#[tokio::test]
async fn idle_channels_of_a_flood_are_closed_for_those_of_a_new_vehicle() {
    let scene = Scene::new().await;
    let mut channels = scene.channels();
    for address in 0..200 {
        let from = Some(format!("10.1.{address}.1").parse().unwrap());
        for component in 1..=250 {
            let source = format!("{}.1.{component}", 1000 + address);
            scene.publish_from(&mut channels, (&source, from), TIME, 0);
        }
    }
    assert_eq!(channels.all().len(), MOST_CHANNELS);
    let mut viewer = Viewer::connect(&scene).await;
    let mut known = std::collections::BTreeSet::new();
    while known.len() < MOST_CHANNELS {
        let message = viewer.text().await;
        let some = message["channels"].as_array().into_iter().flatten();
        known.extend(some.map(|it| it["id"].as_u64().unwrap()));
    }
    let vehicle = ("101.1.1", Some("10.0.0.1".parse().unwrap()));
    let later = TIME + 11_000_000_000;
    assert!(scene.publish_from(&mut channels, vehicle, later, 5));
    let closed = viewer.text().await;
    assert_eq!(closed["op"], "unadvertise");
    let ids = closed["channelIds"].as_array().unwrap();
    assert!(
        ids.len() == 1 && known.contains(&ids[0].as_u64().unwrap()),
        "{closed}"
    );
    let opened = viewer.text().await;
    let channel = &opened["channels"][0];
    assert_eq!(channel["topic"], "/jaus/101/1/1/ReportStatus");
    assert!(
        !known.contains(&channel["id"].as_u64().unwrap()),
        "a number of its own"
    );
    let subscription = json!({ "id": 9, "channelId": channel["id"] });
    viewer
        .say(&json!({ "op": "subscribe", "subscriptions": [subscription] }))
        .await;
    let status = json!({ "Status": 1, "Reserved": 5 });
    assert_eq!(viewer.sample().await, (9, later, status));
}
