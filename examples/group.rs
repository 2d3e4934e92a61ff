//! Watches the speeds of all vehicles, and stops all vehicles if one of them is too fast. Start and
//! stop `cargo run --example sensor` and `cargo run --example driver` beside it.

use jaus::component::{Audience, Component, GroupUpdate, Kind, Priority, When};
use jaus::messages::core::{ClearEmergency, SetEmergency, management};
use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
use jaus::node::{Config, Node};

/// All vehicles are stopped above this speed.
const TOO_FAST: f64 = 2.4;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(44, 1))?;
    let watch = Component::builder(Kind::OperatorControlUnit, "Watch").attach(&node, 1)?;

    // All current and future providers of the service.
    let query = QueryVelocityState::none().with_velocity_x();
    let mut speeds = watch.subscribe_all(velocity_state_sensor::URN, &query, When::hz(5.0))?;
    while let Some((sensor, update)) = speeds.next().await {
        match update {
            GroupUpdate::Up => println!("{sensor} reports its speed"),
            GroupUpdate::Down { why, .. } => println!("{sensor} is down: {why}"),
            GroupUpdate::Gone => println!("{sensor} is gone"),
            GroupUpdate::NotSubscribed { why, .. } => println!("{why}"),
            GroupUpdate::Report(report) => {
                let speed = report.velocity_x_m_per_s().unwrap_or_default();
                if speed > TOO_FAST {
                    println!("{sensor} drives at {speed:.2} m/s: stopping all vehicles");
                    stop_all(&watch).await;
                }
            }
        }
    }
    Ok(())
}

/// Stops every component with Management, and lists those that did not acknowledge.
async fn stop_all(watch: &Component) {
    let vehicles = Audience::providers(management::URN);
    let stop = SetEmergency {
        emergency_code: 1.into(),
    };
    let urgent = Priority::SafetyCritical;
    let results = watch.deliver_all_with(urgent, &vehicles, &stop).await;
    for (vehicle, _) in results.successes() {
        println!("{vehicle} acknowledged the stop");
    }
    for (vehicle, why) in results.failures() {
        println!("{vehicle} did not acknowledge: {why}");
    }
    let stopped = ClearEmergency {
        emergency_code: 1.into(),
    };
    if let Err(error) = watch.send_all(&vehicles, &stopped) {
        println!("the emergency is not cleared: {error}");
    }
}
