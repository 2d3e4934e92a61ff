//! The README's component: reports its speed to queries and subscriptions, until Ctrl-C.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(107, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(
            Handlers::new(velocity_state_sensor::LATEST)
                .publishes::<QueryVelocityState>()
                .declines::<QueryVelocityStateExt>(),
        )
        .attach(&node, 44)?;

    // A real vehicle reads its sensors here.
    let report = ReportVelocityState::default().with_velocity_x_m_per_s(1.5)?;
    rover.publish(report, std::time::SystemTime::now()).await?;
    Ok(tokio::signal::ctrl_c().await?)
}
