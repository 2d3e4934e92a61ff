//! An operator that finds whoever tells a speed, and asks once. Start `cargo run --example rover`
//! in another terminal, before or after.

use jaus::component::{Component, Kind};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(42, 1))?;
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator").attach(&node, 1)?;

    let sensor = operator.find(velocity_state_sensor::URN).await?;
    let query = QueryVelocityState {
        presence_vector: 0xFFFF,
    };
    let report: ReportVelocityState = operator.query(sensor, &query).await?;
    match report.velocity_x_m_per_s() {
        Some(speed) => println!("{sensor} drives at {speed:.2} m/s"),
        None => println!("{sensor} does not know its speed"),
    }
    node.shutdown().await;
    Ok(())
}
