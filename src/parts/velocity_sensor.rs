//! The velocity state sensor: how fast the vehicle moves, as its wheels tell.
#![expect(
    clippy::disallowed_methods,
    reason = "here the sensor gets its time, and waits for it"
)]

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::time::timeout;

use super::drivers::Sense;
use super::{Part, PartError, Seat};
use crate::messages::ground::{QueryWheelOdometry, ReportWheelOdometry, wheel_odometry};
use crate::messages::mobility::{QueryVelocityState, QueryVelocityStateExt};
use crate::service::mobility::Vehicle;
use crate::vehicle::{Frame, Motion, Observed, Pilot, Speedometer, Velocity, WheelCount};

/// Makes the velocity of the vehicle out of the travel of its wheels.
///
/// It offers Velocity State Sensor. While the wheels can not be heard its reports leave out what is
/// not known.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocitySensor {
    /// How often the wheels are asked for, in hertz.
    pub hz: f64,
    /// The velocity is not known any more when the wheels have not been heard for so long.
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
    async fn run(self, seat: Seat) -> Result<Infallible, PartError> {
        let observed = Observed::new(moving(unknown()));
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()))
            .with_time(Instant::now(), super::time_of_day());
        let component = seat
            .component("Velocity State Sensor")
            .offer(vehicle.velocity_state_sensor())
            .live_on(seat.port)?;
        let query = QueryWheelOdometry {};
        let mut counts: Sense<ReportWheelOdometry> = Sense::of(
            &component,
            wheel_odometry::URN,
            &query,
            self.hz,
            "wheel travel",
        )?;
        let mut speedometer = Speedometer::default();
        loop {
            let velocity = match timeout(self.silence, counts.next()).await {
                Ok(report) => speedometer.handle_count(WheelCount::from(&report?)),
                Err(_) => {
                    speedometer = Speedometer::default();
                    None
                }
            };
            observed.set(moving(velocity.unwrap_or_else(unknown)));
            component.changed::<QueryVelocityState>().await;
            component.changed::<QueryVelocityStateExt>().await;
        }
    }
}

fn moving(velocity: Velocity) -> Motion {
    Motion {
        velocity,
        ..Motion::default()
    }
}

/// What is not known is not reported.
fn unknown() -> Velocity {
    Velocity::forward(f64::NAN, f64::NAN)
}
