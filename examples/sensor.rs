//! A vehicle that reports its speed to queries and subscriptions, until Ctrl-C.
//! `cargo run --example client` subscribes to it.

use std::time::UNIX_EPOCH;

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::report_velocity_state::{TimeStamp, VelocityX, YawRate};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(speedometer())
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());
    Ok(tokio::signal::ctrl_c().await?)
}

pub(crate) fn speedometer() -> Handlers {
    let mut time = 0.0_f64;
    Handlers::new(velocity_state_sensor::LATEST).answer(move |_: QueryVelocityState| {
        // A real vehicle would read its sensors here.
        time += 0.1;
        // Clients get the fields that their presence vectors request.
        ReportVelocityState {
            velocity_x: VelocityX::new(1.5 + time.sin()).ok(),
            yaw_rate: YawRate::new(0.1 * time.cos()).ok(),
            time_stamp: UNIX_EPOCH.elapsed().ok().map(TimeStamp::at),
            ..ReportVelocityState::default()
        }
    })
}
