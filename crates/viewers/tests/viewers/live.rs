//! The protocol as a well-behaved viewer sees it.

use jaus_test_kit::waiting::until;
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
