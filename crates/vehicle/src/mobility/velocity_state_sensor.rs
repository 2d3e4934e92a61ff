//! Velocity State Sensor: the vehicle's velocity along and about its own axes.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use super::wanted::Wanted;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_velocity_state::{
    PitchRate, RollRate, VelocityX, VelocityY, VelocityZ, YawRate,
};
use jaus::messages::mobility::report_velocity_state_ext::{
    self, SpeedOverGround, VelocityVar, VelocityVehicleXyzRec,
};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, ReportVelocityStateExt,
    velocity_state_sensor,
};
use jaus::service::{Context, Handled};

pub(super) struct VelocityStateSensor;

impl Behaviour for VelocityStateSensor {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(velocity_state_sensor::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryVelocityState::CODE => exchange.answer(report),
            QueryVelocityStateExt::CODE => exchange.answer(report_ext),
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_motion(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        context.changed::<QueryVelocityState>();
        context.changed::<QueryVelocityStateExt>();
    }
}

fn report(query: &QueryVelocityState, exchange: &mut Exchange<'_, '_>) -> ReportVelocityState {
    let velocity = exchange.controls.pilot.motion().velocity;
    let wanted = Wanted(query.presence_vector.into());
    ReportVelocityState {
        velocity_x: wanted.real(0, velocity.x, VelocityX::new),
        velocity_y: wanted.real(1, velocity.y, VelocityY::new),
        velocity_z: wanted.real(2, velocity.z, VelocityZ::new),
        velocity_rms: None,
        roll_rate: wanted.real(4, velocity.roll, RollRate::new),
        pitch_rate: wanted.real(5, velocity.pitch, PitchRate::new),
        yaw_rate: wanted.real(6, velocity.yaw, YawRate::new),
        rate_rms: None,
        time_stamp: wanted.field(8, exchange.stamp()),
    }
}

fn report_ext(
    query: &QueryVelocityStateExt,
    exchange: &mut Exchange<'_, '_>,
) -> ReportVelocityStateExt {
    let (seconds, nanoseconds) = exchange.seconds_and_nanoseconds();
    let velocity = exchange.controls.pilot.motion().velocity;
    let wanted = Wanted(query.velocity_var_presence_vector.into());
    let along = VelocityVehicleXyzRec {
        velocity_x: wanted.real(0, velocity.x, VelocityX::new),
        velocity_y: wanted.real(1, velocity.y, VelocityY::new),
        velocity_z: wanted.real(2, velocity.z, VelocityZ::new),
    };
    let wanted = Wanted(query.report_velocity_state_ext_rec_presence_vector.into());
    ReportVelocityStateExt {
        velocity_var: VelocityVar::VelocityVehicleXyzRec(along),
        report_velocity_state_ext_rec: report_velocity_state_ext::ReportVelocityStateExtRec {
            roll_rate: wanted.real(1, velocity.roll, report_velocity_state_ext::RollRate::new),
            pitch_rate: wanted.real(2, velocity.pitch, report_velocity_state_ext::PitchRate::new),
            yaw_rate: wanted.real(3, velocity.yaw, report_velocity_state_ext::YawRate::new),
            speed_over_ground: wanted.real(5, velocity.x.hypot(velocity.y), SpeedOverGround::new),
            time_seconds: wanted.field(9, seconds),
            time_nano_seconds: wanted.field(10, nanoseconds),
            ..Default::default()
        },
    }
}
