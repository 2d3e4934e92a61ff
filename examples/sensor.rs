//! A vehicle that reports its speed to queries and subscriptions, until Ctrl-C.
//! `cargo run --example client` subscribes to it.

use std::time::{Duration, SystemTime};

use jaus::component::{Component, Handlers, Kind, PublishError};
use jaus::messages::mobility::report_velocity_state::{VelocityX, YawRate};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(speedometer())
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());
    tokio::select! {
        failure = measure(&rover) => Ok(failure?),
        ended = tokio::signal::ctrl_c() => Ok(ended?),
    }
}

pub(crate) fn speedometer() -> Handlers {
    Handlers::new(velocity_state_sensor::LATEST).publishes::<QueryVelocityState>()
}

pub(crate) async fn measure(rover: &Component) -> Result<(), PublishError> {
    for step in 0.. {
        // A real vehicle would read its sensors here.
        let time = 0.1 * f64::from(step);
        let report = ReportVelocityState {
            velocity_x: VelocityX::new(1.5 + time.sin()).ok(),
            yaw_rate: YawRate::new(0.1 * time.cos()).ok(),
            ..ReportVelocityState::default()
        };
        // Clients get the fields that they request, and the time of the sample.
        rover.publish(report, SystemTime::now()).await?;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    Ok(())
}
