//! The IMU sensor (component 52): rates of turn and acceleration from an inertial measurement unit.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the sensor its clock and timer"
)]

use std::convert::Infallible;
use std::path::PathBuf;
use std::time::Duration;

use tokio::time::timeout;

use super::iio_device::next_reading;
use super::{IioDevice, Part, PartError, Slot};
use crate::mobility::both_versions;
use crate::navigation::{IioImu, InertialSample};
use jaus::component::Handlers;
use jaus::messages::mobility::{
    QueryAccelerationState, QueryAccelerationStateExt, QueryVelocityState, QueryVelocityStateExt,
    ReportAccelerationState, ReportAccelerationStateExt, ReportVelocityState,
    ReportVelocityStateExt, acceleration_state_sensor, velocity_state_sensor,
};

/// Reports what an inertial measurement unit measures, 50 times a second.
///
/// It offers Velocity State Sensor, with yaw rate, and roll and pitch rate if the device has these
/// axes; and Acceleration State Sensor if the device has an accelerometer. The values have the
/// device's bias. Without measurements all are unknown and omitted from the reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImuSensor {
    /// The device.
    pub device: IioDevice,
    /// The values become unknown without a measurement for this time. A device that repeats one
    /// reading has stopped measuring after 1 s.
    pub silence: Duration,
}

impl Default for ImuSensor {
    fn default() -> Self {
        Self {
            device: IioDevice {
                directory: PathBuf::from("/sys/bus/iio/devices/iio:device0"),
                inverted: false,
            },
            silence: Duration::from_millis(300),
        }
    }
}

impl Part for ImuSensor {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let device = self.device.open()?;
        let has_accelerometer = device.has_accelerometer();
        let mut samples = IioDevice::start(device, IioImu::sample)?;
        let mut builder = slot.timed_component("IMU Sensor").offer(velocity_service());
        if has_accelerometer {
            builder = builder.offer(acceleration_service());
        }
        let component = builder.live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let mut is_lost = false;
        loop {
            let sample = match timeout(self.silence, next_reading(&mut samples)).await {
                Ok(Some(sample)) => Some(sample),
                Ok(None) => return Err(PartError::Broken("the reading thread ended".to_owned())),
                Err(_) => None,
            };
            match (is_lost, &sample) {
                (false, None) => tracing::warn!("no inertial measurement: all values are unknown"),
                (true, Some(_)) => tracing::info!("inertial measurements are back"),
                _ => {}
            }
            is_lost = sample.is_none();
            let age = sample.map_or(Duration::ZERO, |it| it.at.elapsed());
            if let Some(sample) = &sample {
                slot.telemetry.set_sampled("inertial", sample.at);
            }
            let now = slot.time.system_time();
            let sampled_at = now.checked_sub(age).unwrap_or(now);
            let InertialSample {
                velocity,
                acceleration,
            } = sample.map_or(InertialSample::UNKNOWN, |it| it.value);
            let report = ReportVelocityState::from(velocity);
            component.publish(report, sampled_at).await?;
            let report = ReportVelocityStateExt::from(velocity);
            component.publish(report, sampled_at).await?;
            if has_accelerometer {
                let report = ReportAccelerationState::from(acceleration);
                component.publish(report, sampled_at).await?;
                let report = ReportAccelerationStateExt::from(acceleration);
                component.publish(report, sampled_at).await?;
            }
        }
    }
}

fn velocity_service() -> Handlers {
    let [newest, older] = both_versions(velocity_state_sensor::V1_1);
    Handlers::new(newest)
        .and_version(older)
        .publishes::<QueryVelocityState>()
        .publishes::<QueryVelocityStateExt>()
}

fn acceleration_service() -> Handlers {
    Handlers::new(acceleration_state_sensor::V1_1)
        .publishes::<QueryAccelerationState>()
        .publishes::<QueryAccelerationStateExt>()
}
