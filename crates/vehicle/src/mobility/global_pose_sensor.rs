//! Global Pose Sensor: the vehicle's pose on the globe, and the magnetic variation.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use crate::motion::GlobalPose;
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_global_pose as fields;
use jaus::messages::mobility::report_global_pose_ext as ext;
use jaus::messages::mobility::set_global_pose_ext::ZPosition;
use jaus::messages::mobility::{
    QueryGeomagneticProperty, QueryGlobalPose, QueryGlobalPoseExt, ReportGeomagneticProperty,
    ReportGlobalPose, ReportGlobalPoseExt, SetGeomagneticProperty, SetGlobalPose, SetGlobalPoseExt,
    global_pose_sensor,
};
use jaus::service::{Context, Handled};

pub(super) struct GlobalPoseSensor;

impl Behaviour for GlobalPoseSensor {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(global_pose_sensor::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            QueryGlobalPose::CODE => exchange.answer(report),
            QueryGlobalPoseExt::CODE => exchange.answer(report_ext),
            QueryGeomagneticProperty::CODE => {
                let mut report = ReportGeomagneticProperty::default();
                let variation = exchange.controls.magnetic_variation;
                if report.set_magnetic_variation_rad(variation).is_ok() {
                    exchange.reply(&report);
                }
            }
            SetGlobalPose::CODE => {
                if let Some(message) = exchange.configure() {
                    set(updated(&message, &pose(exchange)), exchange);
                }
            }
            SetGlobalPoseExt::CODE => {
                if let Some(message) = exchange.configure() {
                    set(updated_ext(&message, &pose(exchange)), exchange);
                }
            }
            SetGeomagneticProperty::CODE => {
                if let Some(message) = exchange.configure::<SetGeomagneticProperty>() {
                    exchange.controls.magnetic_variation = message.magnetic_variation_rad();
                    exchange.context.changed::<QueryGeomagneticProperty>();
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn set_up_by(&self) -> Option<&'static str> {
        Some(SetGlobalPose::NAME)
    }

    fn handle_motion(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        changed(context);
    }
}

fn changed(context: &mut Context<'_>) {
    context.changed::<QueryGlobalPose>();
    context.changed::<QueryGlobalPoseExt>();
}

fn pose(exchange: &Exchange<'_, '_>) -> GlobalPose {
    exchange.controls.pilot.global_pose()
}

fn set(pose: GlobalPose, exchange: &mut Exchange<'_, '_>) {
    let (latitude, longitude, yaw) = (pose.latitude, pose.longitude, pose.yaw);
    tracing::info!(source = %exchange.message.source, latitude, longitude, yaw, "global pose set");
    exchange.controls.set_global_pose(pose);
    changed(exchange.context);
}

/// A pose updated with the fields that the client sets. The others keep their values.
fn updated(message: &SetGlobalPose, pose: &GlobalPose) -> GlobalPose {
    GlobalPose {
        latitude: message.latitude_deg().unwrap_or(pose.latitude),
        longitude: message.longitude_deg().unwrap_or(pose.longitude),
        altitude: message.altitude_m().unwrap_or(pose.altitude),
        roll: message.roll_rad().unwrap_or(pose.roll),
        pitch: message.pitch_rad().unwrap_or(pose.pitch),
        yaw: message.yaw_rad().unwrap_or(pose.yaw),
    }
}

fn updated_ext(message: &SetGlobalPoseExt, pose: &GlobalPose) -> GlobalPose {
    let altitude = match message.z_position {
        Some(ZPosition::AltitudeMsl(altitude)) => altitude.value(),
        // The local height of the ground or the water is unknown.
        _ => pose.altitude,
    };
    GlobalPose {
        latitude: message.latitude_deg().unwrap_or(pose.latitude),
        longitude: message.longitude_deg().unwrap_or(pose.longitude),
        altitude,
        roll: message.roll_rad().unwrap_or(pose.roll),
        pitch: message.pitch_rad().unwrap_or(pose.pitch),
        yaw: message.heading_rad().unwrap_or(pose.yaw),
    }
}

fn report(_: &QueryGlobalPose, exchange: &mut Exchange<'_, '_>) -> ReportGlobalPose {
    let (pose, motion) = (pose(exchange), exchange.controls.pilot.motion());
    ReportGlobalPose {
        latitude: fields::Latitude::new(pose.latitude).ok(),
        longitude: fields::Longitude::new(pose.longitude).ok(),
        altitude: fields::Altitude::new(pose.altitude).ok(),
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

fn report_ext(_: &QueryGlobalPoseExt, exchange: &mut Exchange<'_, '_>) -> ReportGlobalPoseExt {
    let (pose, motion) = (pose(exchange), exchange.controls.pilot.motion());
    ReportGlobalPoseExt {
        latitude: ext::Latitude::new(pose.latitude).ok(),
        longitude: ext::Longitude::new(pose.longitude).ok(),
        altitude_msl: ext::AltitudeMsl::new(pose.altitude).ok(),
        roll: ext::Roll::new(pose.roll).ok(),
        pitch: ext::Pitch::new(pose.pitch).ok(),
        heading: ext::Heading::new(pose.yaw).ok(),
        xy_position_rms: motion
            .position_rms
            .and_then(|it| ext::XyPositionRms::new(it).ok()),
        attitude_rms: motion
            .attitude_rms
            .and_then(|it| ext::AttitudeRms::new(it).ok()),
        ..ReportGlobalPoseExt::default()
    }
}
