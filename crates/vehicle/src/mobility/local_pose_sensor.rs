//! Local Pose Sensor: the vehicle's pose in its local frame, and setting that pose.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use super::wanted::Wanted;
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
                    set(told(&message, &pose(exchange)), exchange);
                }
            }
            SetLocalPoseExt::CODE => {
                if let Some(message) = exchange.configure() {
                    set(told_ext(&message, &pose(exchange)), exchange);
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
    exchange.controls.pilot.set_pose(pose);
    exchange.controls.handle_new_frame();
    changed(exchange.context);
}

/// A pose updated with the fields that the client sets. The others keep their values.
fn told(message: &SetLocalPose, pose: &Pose) -> Pose {
    Pose {
        x: message.x_m().unwrap_or(pose.x),
        y: message.y_m().unwrap_or(pose.y),
        z: message.z_m().unwrap_or(pose.z),
        roll: message.roll_rad().unwrap_or(pose.roll),
        pitch: message.pitch_rad().unwrap_or(pose.pitch),
        yaw: message.yaw_rad().unwrap_or(pose.yaw),
    }
}

fn told_ext(message: &SetLocalPoseExt, pose: &Pose) -> Pose {
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

fn report(query: &QueryLocalPose, exchange: &mut Exchange<'_, '_>) -> ReportLocalPose {
    let pose = pose(exchange);
    let wanted = Wanted(query.presence_vector.into());
    ReportLocalPose {
        x: wanted.real(0, pose.x, fields::X::new),
        y: wanted.real(1, pose.y, fields::Y::new),
        z: wanted.real(2, pose.z, fields::Z::new),
        position_rms: None,
        roll: wanted.real(4, pose.roll, fields::Roll::new),
        pitch: wanted.real(5, pose.pitch, fields::Pitch::new),
        yaw: wanted.real(6, pose.yaw, fields::Yaw::new),
        attitude_rms: None,
        time_stamp: wanted.field(8, exchange.stamp()),
    }
}

fn report_ext(query: &QueryLocalPoseExt, exchange: &mut Exchange<'_, '_>) -> ReportLocalPoseExt {
    let (seconds, nanoseconds) = exchange.seconds_and_nanoseconds();
    let pose = pose(exchange);
    let wanted = Wanted(query.presence_vector.into());
    ReportLocalPoseExt {
        x: wanted.real(0, pose.x, ext::X::new),
        y: wanted.real(1, pose.y, ext::Y::new),
        z_local: wanted.real(6, pose.z, ext::ZLocal::new),
        roll: wanted.real(9, pose.roll, ext::Roll::new),
        pitch: wanted.real(10, pose.pitch, ext::Pitch::new),
        heading: wanted.real(11, pose.yaw, ext::Heading::new),
        time_seconds: wanted.field(14, seconds),
        time_nano_seconds: wanted.field(15, nanoseconds),
        ..ReportLocalPoseExt::default()
    }
}
