//! Local Pose Sensor: the vehicle's pose in its local frame, and setting that pose.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use crate::motion::Pose;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_local_pose as fields;
use jaus::messages::mobility::report_local_pose_ext as ext;
use jaus::messages::mobility::set_local_pose_ext::ZPosition;
use jaus::messages::mobility::{
    QueryLocalPose, QueryLocalPoseExt, ReportLocalPose, ReportLocalPoseExt, SetLocalPose,
    SetLocalPoseExt, local_pose_sensor,
};
use jaus::service::{Context, Handled};

pub(super) struct LocalPoseSensor;

impl Behaviour for LocalPoseSensor {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(local_pose_sensor::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryLocalPose::CODE => exchange.answer(report),
            QueryLocalPoseExt::CODE => exchange.answer(report_ext),
            SetLocalPose::CODE => {
                if let Some(message) = exchange.configure() {
                    set(updated(&message, &pose(exchange)), exchange);
                }
            }
            SetLocalPoseExt::CODE => {
                if let Some(message) = exchange.configure() {
                    set(updated_ext(&message, &pose(exchange)), exchange);
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn set_up_by(&self) -> Option<&'static str> {
        Some(SetLocalPose::NAME)
    }

    fn handle_motion(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        changed(context);
    }
}

fn changed(context: &mut Context<'_>) {
    context.changed::<QueryLocalPose>();
    context.changed::<QueryLocalPoseExt>();
}

fn pose(exchange: &Exchange<'_, '_>) -> Pose {
    exchange.controls.pilot.motion().pose
}

fn set(pose: Pose, exchange: &mut Exchange<'_, '_>) {
    let (x, y, yaw) = (pose.x, pose.y, pose.yaw);
    tracing::info!(source = %exchange.message.source, x, y, yaw, "local pose set");
    exchange.controls.set_pose(pose);
    changed(exchange.context);
}

/// A pose updated with the fields that the client sets. The others keep their values.
fn updated(message: &SetLocalPose, pose: &Pose) -> Pose {
    Pose {
        x: message.x_m().unwrap_or(pose.x),
        y: message.y_m().unwrap_or(pose.y),
        z: message.z_m().unwrap_or(pose.z),
        roll: message.roll_rad().unwrap_or(pose.roll),
        pitch: message.pitch_rad().unwrap_or(pose.pitch),
        yaw: message.yaw_rad().unwrap_or(pose.yaw),
    }
}

fn updated_ext(message: &SetLocalPoseExt, pose: &Pose) -> Pose {
    let z = match message.z_position {
        Some(ZPosition::ZLocal(z)) => z.value(),
        // Heights above another reference say nothing about the local frame.
        _ => pose.z,
    };
    Pose {
        x: message.x_m().unwrap_or(pose.x),
        y: message.y_m().unwrap_or(pose.y),
        z,
        roll: message.roll_rad().unwrap_or(pose.roll),
        pitch: message.pitch_rad().unwrap_or(pose.pitch),
        yaw: message.heading_rad().unwrap_or(pose.yaw),
    }
}

fn report(_: &QueryLocalPose, exchange: &mut Exchange<'_, '_>) -> ReportLocalPose {
    let (pose, motion) = (pose(exchange), exchange.controls.pilot.motion());
    ReportLocalPose {
        x: fields::X::new(pose.x).ok(),
        y: fields::Y::new(pose.y).ok(),
        z: fields::Z::new(pose.z).ok(),
        position_rms: motion
            .position_rms
            .and_then(|it| fields::PositionRms::new(it).ok()),
        roll: fields::Roll::new(pose.roll).ok(),
        pitch: fields::Pitch::new(pose.pitch).ok(),
        yaw: fields::Yaw::new(pose.yaw).ok(),
        attitude_rms: motion
            .attitude_rms
            .and_then(|it| fields::AttitudeRms::new(it).ok()),
        time_stamp: None,
    }
}

fn report_ext(_: &QueryLocalPoseExt, exchange: &mut Exchange<'_, '_>) -> ReportLocalPoseExt {
    let (pose, motion) = (pose(exchange), exchange.controls.pilot.motion());
    ReportLocalPoseExt {
        x: ext::X::new(pose.x).ok(),
        y: ext::Y::new(pose.y).ok(),
        z_local: ext::ZLocal::new(pose.z).ok(),
        roll: ext::Roll::new(pose.roll).ok(),
        pitch: ext::Pitch::new(pose.pitch).ok(),
        heading: ext::Heading::new(pose.yaw).ok(),
        xy_position_rms: motion
            .position_rms
            .and_then(|it| ext::XyPositionRms::new(it).ok()),
        attitude_rms: motion
            .attitude_rms
            .and_then(|it| ext::AttitudeRms::new(it).ok()),
        ..ReportLocalPoseExt::default()
    }
}
