//! The README's component: reports its acceleration to queries and subscriptions, until it is ended.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use std::time::{Duration, SystemTime};

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{
    QueryAccelerationState, QueryAccelerationStateExt, ReportAccelerationState,
    ReportAccelerationStateExt, acceleration_state_sensor,
};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(107, 1))?;
    let sensor = Handlers::new(acceleration_state_sensor::LATEST)
        .publishes::<QueryAccelerationState>()
        .publishes::<QueryAccelerationStateExt>();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(sensor)
        .attach(&node, 52)?;
    let mut report = ReportAccelerationState::default();
    let mut extended = ReportAccelerationStateExt::default();
    loop {
        let (ahead, now) = (0.5, SystemTime::now()); // A real vehicle would read its sensor here.
        report.set_acceleration_x_m_per_s2(ahead)?;
        extended.set_acceleration_x_m_per_s2(ahead)?;
        rover.publish(report.clone(), now).await?;
        rover.publish(extended.clone(), now).await?;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}
