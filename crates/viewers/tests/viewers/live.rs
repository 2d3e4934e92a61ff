//! The protocol as a well-behaved viewer sees it.

use jaus_test_kit::waiting::until;
use serde_json::json;

use crate::scene::{Scene, Viewer};

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
    viewer.settle().await;
    scene.publish(&mut channels, "101.1.1", 3);
    let (subscription, time, value) = viewer.sample().await;
    assert_eq!((subscription, time), (7, 5));
    assert_eq!(value, json!({ "Status": 1, "Reserved": 3 }));
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
