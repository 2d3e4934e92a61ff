//! A vehicle that reports its speed to queries and subscriptions, until Ctrl-C.
//! `cargo run --example client` subscribes to it.
#![expect(clippy::disallowed_methods, reason = "an application has a clock")]

use std::error::Error;
use std::time::{Duration, SystemTime};

use jaus::component::{Component, Handlers, Kind};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, ReportVelocityStateExt,
    velocity_state_sensor,
};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    // Version 1.1 of the service has both reports, version 1.0 only the first.
    let speedometer = Handlers::new(velocity_state_sensor::LATEST)
        .publishes::<QueryVelocityState>()
        .publishes::<QueryVelocityStateExt>();
    let node = Node::start(Config::loopback(101, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(speedometer)
        .attach(&node, 33)?;
    println!("{} is up; Ctrl-C ends it", rover.id());
    tokio::select! {
        failure = measure(&rover) => failure,
        ended = tokio::signal::ctrl_c() => Ok(ended?),
    }
}

async fn measure(rover: &Component) -> Result<(), Box<dyn Error>> {
    let mut report = ReportVelocityState::default();
    let mut report_ext = ReportVelocityStateExt::default();
    for step in 0.. {
        // A real vehicle would read its sensors here.
        let time = 0.1 * f64::from(step);
        let (speed, yaw_rate) = (1.5 + time.sin(), 0.1 * time.cos());
        report.set_velocity_x_m_per_s(speed)?;
        report.set_yaw_rate_rad_per_s(yaw_rate)?;
        let fields = &mut report_ext.report_velocity_state_ext_rec;
        fields.set_speed_over_ground_m_per_s(speed)?;
        fields.set_yaw_rate_rad_per_s(yaw_rate)?;
        // Clients get the fields that they request, and the time of the sample.
        let sampled_at = SystemTime::now();
        rover.publish(report.clone(), sampled_at).await?;
        rover.publish(report_ext.clone(), sampled_at).await?;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    Ok(())
}
