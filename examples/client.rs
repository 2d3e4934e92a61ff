//! Finds a velocity sensor, subscribes to it, and reports when it goes down and comes back: stop
//! `cargo run --example sensor`, and start it again.

use jaus::component::{Component, Kind, Update, When};
use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(42, 1))?;
    let client = Component::builder(Kind::OperatorControlUnit, "Client").attach(&node, 1)?;

    let sensor = client.find(velocity_state_sensor::URN).await?;
    let query = QueryVelocityState::none().with_velocity_x();
    let mut speeds = client.subscribe(sensor, &query, When::hz(5.0)).await?;
    while let Some(update) = speeds.next().await {
        match update {
            Update::Up => println!("{sensor} reports its speed"),
            Update::Report(report) => {
                if let Some(speed) = report.velocity_x_m_per_s() {
                    println!("{speed:.2} m/s");
                }
            }
            Update::Down { why, .. } => println!("{sensor} is down: {why}"),
        }
    }
    Ok(())
}
