//! Velocity State Sensor: the vehicle's velocity along and about its own axes.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_velocity_state::{
    PitchRate, RollRate, VelocityX, VelocityY, VelocityZ, YawRate,
};
use jaus::messages::mobility::report_velocity_state_ext::{
    self as ext, SpeedOverGround, VelocityVar, VelocityVehicleXyzRec,
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

fn report(_: &QueryVelocityState, exchange: &mut Exchange<'_, '_>) -> ReportVelocityState {
    let velocity = exchange.controls.pilot.motion().velocity;
    ReportVelocityState {
        velocity_x: VelocityX::new(velocity.x).ok(),
        velocity_y: VelocityY::new(velocity.y).ok(),
        velocity_z: VelocityZ::new(velocity.z).ok(),
        velocity_rms: None,
        roll_rate: RollRate::new(velocity.roll).ok(),
        pitch_rate: PitchRate::new(velocity.pitch).ok(),
        yaw_rate: YawRate::new(velocity.yaw).ok(),
        rate_rms: None,
        time_stamp: exchange.stamp(),
    }
}

fn report_ext(
    query: &QueryVelocityStateExt,
    exchange: &mut Exchange<'_, '_>,
) -> ReportVelocityStateExt {
    let (seconds, nanoseconds) = exchange.seconds_and_nanoseconds();
    let velocity = exchange.controls.pilot.motion().velocity;
    let asked = query.velocity_var_presence_vector.into();
    let along = VelocityVehicleXyzRec {
        velocity_x: requested(asked, 0, VelocityX::new(velocity.x).ok()),
        velocity_y: requested(asked, 1, VelocityY::new(velocity.y).ok()),
        velocity_z: requested(asked, 2, VelocityZ::new(velocity.z).ok()),
    };
    let asked = query.report_velocity_state_ext_rec_presence_vector;
    let over_ground = SpeedOverGround::new(velocity.x.hypot(velocity.y));
    ReportVelocityStateExt {
        velocity_var: VelocityVar::VelocityVehicleXyzRec(along),
        report_velocity_state_ext_rec: ext::ReportVelocityStateExtRec {
            roll_rate: requested(asked, 1, ext::RollRate::new(velocity.roll).ok()),
            pitch_rate: requested(asked, 2, ext::PitchRate::new(velocity.pitch).ok()),
            yaw_rate: requested(asked, 3, ext::YawRate::new(velocity.yaw).ok()),
            speed_over_ground: requested(asked, 5, over_ground.ok()),
            time_seconds: requested(asked, 9, seconds),
            time_nano_seconds: requested(asked, 10, nanoseconds),
            ..Default::default()
        },
    }
}

/// The field of a nested record, if its bit of the presence vector is set. Queries select only the
/// report's own fields by themselves.
fn requested<T>(presence_vector: u16, bit: u32, field: Option<T>) -> Option<T> {
    field.filter(|_| presence_vector >> bit & 1 == 1)
}
