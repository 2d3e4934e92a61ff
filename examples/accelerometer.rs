//! The README's component: reports its acceleration to queries and subscriptions, until it is ended.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use std::time::{Duration, SystemTime};

use jaus::codec::ServiceId;
use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{
    QueryAccelerationState, ReportAccelerationState, acceleration_state_sensor,
};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(107, 1))?;
    // Version 1.1 of the service has a second report; version 1.0 has this one alone.
    let version = ServiceId {
        minor: 0,
        ..acceleration_state_sensor::LATEST
    };
    let sensor = Handlers::new(version).publishes::<QueryAccelerationState>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(sensor)
        .attach(&node, 52)?;
    loop {
        let mut report = ReportAccelerationState::default();
        report.set_acceleration_x_m_per_s2(0.5)?;
        rover.publish(report, SystemTime::now()).await?;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}
