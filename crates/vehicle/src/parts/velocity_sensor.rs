//! The velocity state sensor: velocity from wheel travel.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::time::Duration;

use tokio::time::timeout;

use super::drivers::Sense;
use super::{Part, PartError, Slot};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::both_versions;
use crate::motion::{Speedometer, Velocity, WheelCount};
use jaus::component::Handlers;
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, ReportVelocityStateExt,
    velocity_state_sensor,
};
use jaus::node::now;
use jaus::service::SampleAge;

/// Computes the velocity of the vehicle from the travel of its wheels.
///
/// It offers Velocity State Sensor. Without wheel reports, the unknown components are omitted from
/// its own reports.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocitySensor {
    /// Report rate requested for the wheels, in hertz.
    pub hz: f64,
    /// The velocity becomes unknown without wheel reports for this time.
    pub silence: Duration,
}

impl Default for VelocitySensor {
    fn default() -> Self {
        Self {
            hz: 25.0,
            silence: Duration::from_millis(300),
        }
    }
}

impl Part for VelocitySensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let [newest, older] = both_versions(velocity_state_sensor::V1_1);
        let sensor = Handlers::new(newest)
            .and_version(older)
            .publishes::<QueryVelocityState>()
            .publishes::<QueryVelocityStateExt>();
        let component = slot
            .timed_component("Velocity State Sensor")
            .offer(sensor)
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let query = QueryWheelOdometry {};
        let mut counts: Sense<ReportWheelOdometry> = Sense::of(
            &component,
            wheel_odometry::URN,
            &query,
            self.hz,
            "wheel travel",
        )?;
        let mut speedometer = Speedometer::default();
        let mut age = SampleAge::default();
        let mut sampled_at = slot.time.system_time();
        loop {
            let heard = timeout(self.silence, counts.next()).await;
            let now = now();
            if counts.take_loss() {
                age.forget();
            }
            let velocity = match heard {
                Ok(report) => {
                    let count = WheelCount::from(&report?);
                    let read_at = Duration::from_millis(count.time_ms.into());
                    if let Some(at) = age.handle(now, Some(read_at.into())) {
                        slot.telemetry.set_sampled("velocity", at);
                        sampled_at = slot.time.system_time() - now.saturating_duration_since(at);
                    }
                    speedometer.handle_count(count)
                }
                Err(_) => {
                    speedometer = Speedometer::default();
                    sampled_at = slot.time.system_time();
                    None
                }
            };
            let velocity = velocity.unwrap_or_else(unknown);
            slot.telemetry.set_speed(velocity.x);
            let report = ReportVelocityState::from(velocity);
            component.publish(report, sampled_at).await?;
            let report = ReportVelocityStateExt::from(velocity);
            component.publish(report, sampled_at).await?;
        }
    }
}

/// NaN components are omitted from reports.
fn unknown() -> Velocity {
    Velocity::forward(f64::NAN, f64::NAN)
}
