//! A vehicle that can be driven: it obeys the client in control while it is ready, and stops
//! whenever it must not act. `cargo run --example operator` drives it. A subsystem number may be given.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering::Relaxed};

use jaus::component::{Component, Handlers, Kind, Management};
use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let subsystem = std::env::args().nth(1).map_or(Ok(102), |it| it.parse())?;
    let node = Node::start(Config::loopback(subsystem, 1))?;
    // The motor's effort, in percent.
    let motor = Arc::new(AtomicI32::new(0));
    let throttle = motor.clone();
    let driver = Handlers::new(primitive_driver::LATEST)
        .command(move |effort: SetWrenchEffort, from, _| {
            let ahead = effort.propulsive_linear_effort_x_percent().unwrap_or(0.0);
            println!("{} drives with {ahead:.0} %", from.source);
            throttle.store(ahead as i32, Relaxed);
        })
        // Runs on standby, emergency, lost control, a silent client, and shutdown.
        .on_stop(move |_| motor.store(0, Relaxed));

    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(driver)
        .management(Management::new())
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());

    let mut standing = rover.watch_standing();
    loop {
        tokio::select! {
            _ = tokio::signal::ctrl_c() => break,
            Ok(()) = standing.changed() => {
                let now = rover.standing();
                println!("{} now, controlled by {:?}", now.state, now.controller);
            }
        }
    }
    node.shutdown().await; // stops the motor, too
    Ok(())
}
