//! The velocity state sensor: velocity from wheel travel.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::time::timeout;

use super::drivers::{Freshness, Sense};
use super::{Part, PartError, Slot};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::mobility::Vehicle;
use crate::motion::{Frame, Motion, Observed, Pilot, Speedometer, Velocity, WheelCount};
use jaus::messages::mobility::{QueryVelocityState, QueryVelocityStateExt};

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
        let observed = Observed::new(moving(unknown(), None));
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()))
            .with_clock(super::host_clock());
        let component = slot
            .component("Velocity State Sensor")
            .offer(vehicle.velocity_state_sensor())
            .live_on(slot.port)?;
        let query = QueryWheelOdometry {};
        let mut counts: Sense<ReportWheelOdometry> = Sense::of(
            &component,
            wheel_odometry::URN,
            &query,
            self.hz,
            "wheel travel",
        )?;
        let mut speedometer = Speedometer::default();
        let mut freshness = Freshness::default();
        let mut sampled_at = None;
        loop {
            let heard = timeout(self.silence, counts.next()).await;
            let now = Instant::now();
            if counts.take_loss() {
                freshness.forget();
            }
            let velocity = match heard {
                Ok(report) => {
                    let count = WheelCount::from(&report?);
                    let read_at = Duration::from_millis(count.time_ms.into());
                    if let Some(at) = freshness.handle(now, Some(read_at)) {
                        sampled_at = Some(at);
                    }
                    speedometer.handle_count(count)
                }
                Err(_) => {
                    speedometer = Speedometer::default();
                    sampled_at = Some(now);
                    None
                }
            };
            observed.set(moving(velocity.unwrap_or_else(unknown), sampled_at));
            component.changed::<QueryVelocityState>().await;
            component.changed::<QueryVelocityStateExt>().await;
        }
    }
}

fn moving(velocity: Velocity, sampled_at: Option<Instant>) -> Motion {
    Motion {
        velocity,
        sampled_at,
        ..Motion::default()
    }
}

/// NaN components are omitted from reports.
fn unknown() -> Velocity {
    Velocity::forward(f64::NAN, f64::NAN)
}
