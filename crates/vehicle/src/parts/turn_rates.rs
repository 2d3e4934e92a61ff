//! Sources of turn rates for the global pose sensor: a gyroscope of this host, or the component of an
//! inertial measurement unit.

use jaus::component::Component;
use jaus::messages::mobility::ReportVelocityState;
use jaus::node::now;
use jaus::service::SampleAge;

use super::drivers::Sense;
use super::iio_device::{Reading, Readings, next_reading};
use super::{IioDevice, PartError};

/// The gyroscope of a global pose sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Gyro {
    /// A device of this host.
    Device(IioDevice),
    /// A component in the same subsystem that offers Velocity State Sensor and reports a yaw rate and
    /// no velocity, such as [`ImuSensor`](super::ImuSensor). It is found by Discovery.
    Component,
}

/// A running source.
pub(super) enum TurnRates {
    Absent,
    Device(Readings<f64>),
    Component {
        reports: Box<Sense<ReportVelocityState>>,
        age: SampleAge,
    },
}

impl TurnRates {
    /// Subscribes to a component.
    pub(super) fn of_component(component: &Component, hz: f64) -> Result<Self, PartError> {
        Ok(Self::Component {
            reports: Box::new(Sense::yaw_rate(component, hz)?),
            age: SampleAge::default(),
        })
    }

    /// Waits for the next turn rate in radians per second, right positive; forever without a source.
    /// Cancel safe.
    pub(super) async fn next(&mut self) -> Result<Reading<f64>, PartError> {
        match self {
            Self::Absent => std::future::pending().await,
            Self::Device(readings) => next_reading(readings)
                .await
                .ok_or_else(|| PartError::Broken("the gyroscope's input has ended".to_owned())),
            Self::Component { reports, age } => loop {
                let report = reports.next().await?;
                if reports.take_loss() {
                    age.forget();
                }
                let stamp = reports.stamp(report.time_stamp.map(|it| it.0));
                let at = age.handle(now(), stamp);
                // The sensor of the wheels also reports a yaw rate.
                let rate = report.yaw_rate_rad_per_s();
                let rate = rate.filter(|_| report.velocity_x.is_none());
                if let Some((at, value)) = at.zip(rate) {
                    return Ok(Reading { at, value });
                }
            },
        }
    }
}
