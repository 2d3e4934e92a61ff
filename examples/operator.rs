//! Takes control of `cargo run --example driver`, makes it ready, drives until Ctrl-C, and releases
//! control, which stops it.

use std::time::Duration;

use jaus::component::{Component, Kind};
use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(43, 1))?;
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator").attach(&node, 1)?;

    let rover = operator.find(primitive_driver::LATEST).await?;
    let control = operator.control(rover, 127).await?;
    control.resume().await?;
    println!("{rover} is ready");

    let mut ahead = SetWrenchEffort::default();
    ahead.set_propulsive_linear_effort_x_percent(40.0)?;
    let mut beat = tokio::time::interval(Duration::from_millis(100));
    let end = tokio::signal::ctrl_c();
    tokio::pin!(end);
    loop {
        tokio::select! {
            _ = &mut end => break,
            _ = beat.tick() => control.send(&ahead)?, // fails once control is lost
        }
    }
    control.release().await;
    println!("{rover} is free again");
    Ok(())
}
