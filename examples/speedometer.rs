//! The README's speed sensor: reports its speed to queries and subscriptions, until Ctrl-C.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(107, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::new(velocity_state_sensor::V1_0).publishes::<QueryVelocityState>())
        .attach(&node, 44)?;

    let mut report = ReportVelocityState::default();
    report.set_velocity_x_m_per_s(1.5)?; // a real vehicle reads its sensors here
    rover.publish(report, std::time::SystemTime::now()).await?;
    Ok(tokio::signal::ctrl_c().await?)
}
