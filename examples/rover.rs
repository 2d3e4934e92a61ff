//! A vehicle that tells its speed, until Ctrl-C. `cargo run --example operator` asks it.
//!
//! It runs a node of its own that stays on this host; `Config::new` instead of `Config::loopback`
//! takes it to the network. With `--attach` it is a component of the node that another process
//! runs: `jaus node --id 101.1 --loopback --local`.

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Host, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let port = if std::env::args().any(|argument| argument == "--attach") {
        Host::default().attach(33).await?
    } else {
        Node::start(Config::loopback(101, 1))?.attach(33)?
    };

    let mut speed = ReportVelocityState::default();
    speed.set_velocity_x_m_per_s(1.5)?;
    let speedometer = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |_: QueryVelocityState| speed.clone());

    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(speedometer)
        .live_on(port)?;
    println!("{} is up; Ctrl-C ends it", rover.id());

    tokio::signal::ctrl_c().await?;
    Ok(())
}
