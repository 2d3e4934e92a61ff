//! A vehicle that tells its speed, until Ctrl-C. `cargo run --example operator` asks it.
//!
//! Both stay on this host; `Config::new` instead of `Config::loopback` takes them to the network.

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;

    let mut speed = ReportVelocityState::default();
    speed.set_velocity_x_m_per_s(1.5)?;
    let speedometer = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |_: QueryVelocityState| speed.clone());

    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(speedometer)
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());

    tokio::signal::ctrl_c().await?;
    node.shutdown().await;
    Ok(())
}
