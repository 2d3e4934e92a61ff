//! Velocity State Sensor: the vehicle's velocity along and about its own axes.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use crate::motion::Velocity;
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
    exchange.controls.pilot.motion().velocity.into()
}

fn report_ext(
    _: &QueryVelocityStateExt,
    exchange: &mut Exchange<'_, '_>,
) -> ReportVelocityStateExt {
    exchange.controls.pilot.motion().velocity.into()
}

/// Without the components that are NaN.
impl From<Velocity> for ReportVelocityState {
    fn from(velocity: Velocity) -> Self {
        Self {
            velocity_x: VelocityX::new(velocity.x).ok(),
            velocity_y: VelocityY::new(velocity.y).ok(),
            velocity_z: VelocityZ::new(velocity.z).ok(),
            roll_rate: RollRate::new(velocity.roll).ok(),
            pitch_rate: PitchRate::new(velocity.pitch).ok(),
            yaw_rate: YawRate::new(velocity.yaw).ok(),
            ..Self::default()
        }
    }
}

/// Without the components that are NaN.
impl From<Velocity> for ReportVelocityStateExt {
    fn from(velocity: Velocity) -> Self {
        let along = VelocityVehicleXyzRec {
            velocity_x: VelocityX::new(velocity.x).ok(),
            velocity_y: VelocityY::new(velocity.y).ok(),
            velocity_z: VelocityZ::new(velocity.z).ok(),
        };
        let over_ground = SpeedOverGround::new(velocity.x.hypot(velocity.y));
        Self {
            velocity_var: VelocityVar::VelocityVehicleXyzRec(along),
            report_velocity_state_ext_rec: ext::ReportVelocityStateExtRec {
                roll_rate: ext::RollRate::new(velocity.roll).ok(),
                pitch_rate: ext::PitchRate::new(velocity.pitch).ok(),
                yaw_rate: ext::YawRate::new(velocity.yaw).ok(),
                speed_over_ground: over_ground.ok(),
                ..Default::default()
            },
        }
    }
}
