//! Acceleration State Sensor: the vehicle's acceleration along and about its own axes.

use super::behaviour::Behaviour;
use super::controls::Controls;
use super::exchange::Exchange;
use crate::motion::Acceleration;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_acceleration_state as fields;
use jaus::messages::mobility::report_acceleration_state_ext as ext;
use jaus::messages::mobility::{
    QueryAccelerationState, QueryAccelerationStateExt, ReportAccelerationState,
    ReportAccelerationStateExt, acceleration_state_sensor,
};
use jaus::service::{Context, Handled};

pub(super) struct AccelerationStateSensor;

impl Behaviour for AccelerationStateSensor {
    fn offers(&self) -> Vec<ServiceId> {
        vec![acceleration_state_sensor::V1_1]
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryAccelerationState::CODE => exchange.answer(report),
            QueryAccelerationStateExt::CODE => exchange.answer(report_ext),
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_motion(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        context.changed::<QueryAccelerationState>();
        context.changed::<QueryAccelerationStateExt>();
    }
}

fn report(_: &QueryAccelerationState, exchange: &mut Exchange<'_, '_>) -> ReportAccelerationState {
    exchange.controls.pilot.motion().acceleration.into()
}

fn report_ext(
    _: &QueryAccelerationStateExt,
    exchange: &mut Exchange<'_, '_>,
) -> ReportAccelerationStateExt {
    exchange.controls.pilot.motion().acceleration.into()
}

/// Without the components that are NaN.
impl From<Acceleration> for ReportAccelerationState {
    fn from(acceleration: Acceleration) -> Self {
        Self {
            acceleration_x: fields::AccelerationX::new(acceleration.x).ok(),
            acceleration_y: fields::AccelerationY::new(acceleration.y).ok(),
            acceleration_z: fields::AccelerationZ::new(acceleration.z).ok(),
            roll_acceleration: fields::RollAcceleration::new(acceleration.roll).ok(),
            pitch_acceleration: fields::PitchAcceleration::new(acceleration.pitch).ok(),
            yaw_acceleration: fields::YawAcceleration::new(acceleration.yaw).ok(),
            ..Self::default()
        }
    }
}

/// Without the components that are NaN.
impl From<Acceleration> for ReportAccelerationStateExt {
    fn from(acceleration: Acceleration) -> Self {
        Self {
            acceleration_x: ext::AccelerationX::new(acceleration.x).ok(),
            acceleration_y: ext::AccelerationY::new(acceleration.y).ok(),
            acceleration_z: ext::AccelerationZ::new(acceleration.z).ok(),
            roll_acceleration: ext::RollAcceleration::new(acceleration.roll).ok(),
            pitch_acceleration: ext::PitchAcceleration::new(acceleration.pitch).ok(),
            yaw_acceleration: ext::YawAcceleration::new(acceleration.yaw).ok(),
            ..Self::default()
        }
    }
}
