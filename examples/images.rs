//! A camera with images of 1 MiB at 10 Hz, and two viewers that share a subscription: a slow one gets
//! the latest image, a fast one every image. `cargo run --features every-set --example images`
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use std::time::{Duration, SystemTime};

use jaus::codec::FormattedBlob;
use jaus::component::{Component, Handlers, Kind, PublishError, Subscription, When};
use jaus::messages::environment_sensing::report_still_image_data::*;
use jaus::messages::environment_sensing::*;
use jaus::node::{Config, Node};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let vehicle = Node::start(Config::loopback(104, 1))?;
    let images = Handlers::new(still_image::V1_0)
        .publishes::<QueryStillImageData>()
        .publishes::<QueryStillImageSensorCapabilities>()
        .publishes::<QueryStillImageSensorConfiguration>();
    let camera = Component::builder(Kind::Vehicle, "Camera")
        .offer(images)
        .attach(&vehicle, 33)?;
    tokio::spawn(async move { record(&camera).await });
    let station = Node::start(Config::loopback(46, 1))?;
    let viewer = Component::builder(Kind::OperatorControlUnit, "Viewer").attach(&station, 1)?;
    let camera = viewer.find(still_image::URN).await?;
    let query = QueryStillImageData::default();
    let images = viewer.subscribe(camera, &query, When::OnChange).await?;
    // With a depth of 1, a slow viewer gets the latest image.
    let slow = view("slow", images.share().depth(1), Duration::from_millis(250));
    tokio::join!(slow, view("fast", images, Duration::ZERO));
    Ok(())
}

async fn view(name: &str, mut images: Subscription<ReportStillImageData>, pause: Duration) {
    while let Some(report) = images.report().await {
        let frames = report.still_image_data_list.iter();
        let octets: usize = frames.map(|it| it.image_frame.data.len()).sum();
        let (lost, missed) = (images.lost(), images.missed());
        let age = images.age().unwrap_or_default(); // since the arrival
        println!("{name}: {octets} octets, {age:.1?} old, {lost} lost, {missed} missed");
        tokio::time::sleep(pause).await;
    }
}

async fn record(camera: &Component) -> Result<(), PublishError> {
    for shade in (0..=u8::MAX).cycle() {
        let image = StillImageDataRec {
            image_frame: FormattedBlob::new(ImageFrameFormat::JPEG, vec![shade; 1 << 20]),
            ..StillImageDataRec::default()
        };
        let report = ReportStillImageData {
            still_image_data_list: vec![image],
        };
        camera.publish(report, SystemTime::now()).await?;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    Ok(())
}
