//! Commands two vehicles, each through its restarts: `cargo run --example driver 102`, the same with
//! 103, and this. Either may be stopped and started again.

use std::time::Duration;

use jaus::component::{Audience, Component, Kind, Session, SessionError};
use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(45, 1))?;
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator").attach(&node, 1)?;
    tokio::select! {
        ended = drive(&operator, 102) => ended?,
        ended = drive(&operator, 103) => ended?,
        _ = tokio::signal::ctrl_c() => {}
    }
    node.shutdown().await; // releases both
    Ok(())
}

async fn drive(operator: &Component, subsystem: u16) -> Result<(), SessionError> {
    let driver = Audience::from(primitive_driver::LATEST).in_subsystem(subsystem);
    let mut session = operator.session(driver, 127).await?;
    let mut beat = tokio::time::interval(Duration::from_millis(100));
    loop {
        tokio::select! {
            state = session.changed() => println!("subsystem {subsystem}: {}", state?),
            _ = beat.tick() => command(&session),
        }
    }
}

fn command(session: &Session) {
    let mut ahead = SetWrenchEffort::default();
    if ahead.set_propulsive_linear_effort_x_percent(20.0).is_ok() {
        // Fails while the vehicle is lost, which the state has said.
        let _ = session.send(&ahead);
    }
}
