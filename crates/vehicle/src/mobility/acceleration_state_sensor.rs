//! Acceleration State Sensor: the vehicle's acceleration along and about its own axes.

use super::behaviour::Behaviour;
use super::controls::Controls;
use super::exchange::Exchange;
use super::wanted::Wanted;
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

fn report(
    query: &QueryAccelerationState,
    exchange: &mut Exchange<'_, '_>,
) -> ReportAccelerationState {
    let acceleration = exchange.controls.pilot.motion().acceleration;
    let wanted = Wanted(query.presence_vector.into());
    ReportAccelerationState {
        acceleration_x: wanted.real(0, acceleration.x, fields::AccelerationX::new),
        acceleration_y: wanted.real(1, acceleration.y, fields::AccelerationY::new),
        acceleration_z: wanted.real(2, acceleration.z, fields::AccelerationZ::new),
        acceleration_rms: None,
        roll_acceleration: wanted.real(4, acceleration.roll, fields::RollAcceleration::new),
        pitch_acceleration: wanted.real(5, acceleration.pitch, fields::PitchAcceleration::new),
        yaw_acceleration: wanted.real(6, acceleration.yaw, fields::YawAcceleration::new),
        rotational_acceleration_rms: None,
        time_stamp: wanted.field(8, exchange.stamp()),
    }
}

fn report_ext(
    query: &QueryAccelerationStateExt,
    exchange: &mut Exchange<'_, '_>,
) -> ReportAccelerationStateExt {
    let (seconds, nanoseconds) = exchange.seconds_and_nanoseconds();
    let acceleration = exchange.controls.pilot.motion().acceleration;
    let wanted = Wanted(query.presence_vector.into());
    ReportAccelerationStateExt {
        acceleration_x: wanted.real(0, acceleration.x, ext::AccelerationX::new),
        acceleration_y: wanted.real(1, acceleration.y, ext::AccelerationY::new),
        acceleration_z: wanted.real(2, acceleration.z, ext::AccelerationZ::new),
        acceleration_rms: None,
        roll_acceleration: wanted.real(4, acceleration.roll, ext::RollAcceleration::new),
        pitch_acceleration: wanted.real(5, acceleration.pitch, ext::PitchAcceleration::new),
        yaw_acceleration: wanted.real(6, acceleration.yaw, ext::YawAcceleration::new),
        rotational_acceleration_rms: None,
        time_seconds: wanted.field(8, seconds),
        time_nano_seconds: wanted.field(9, nanoseconds),
    }
}
