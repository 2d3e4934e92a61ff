//! A GNSS sensor: publishes each fix of an NMEA 0183 receiver, with its standard error and the time
//! at which it was measured. `cargo run --example gnss < /dev/ttyACM0`
#![expect(clippy::disallowed_methods, reason = "the date of a fix")]

use std::io::Read;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use jaus::component::{AccessControl, Component, Handlers, Kind};
use jaus::messages::mobility::*;
use jaus::node::{Config, Node};
use jaus_vehicle::navigation::{Fix, Navigation, Receiver};

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut magnetic = ReportGeomagneticProperty::default();
    magnetic.set_magnetic_variation_rad(0.06)?; // of this place, this year
    let sensor = Handlers::new(global_pose_sensor::LATEST)
        .publishes::<QueryGlobalPose>()
        .publishes::<QueryGlobalPoseExt>()
        .answer(move |_: QueryGeomagneticProperty| magnetic.clone());
    let node = Node::start(Config::loopback(105, 1))?;
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(sensor)
        .access_control(AccessControl::new())
        .attach(&node, 43)?;
    println!("{} is up; Ctrl-C ends it", rover.id());
    let mut receiver = Receiver::default();
    for octet in std::io::stdin().lock().bytes() {
        for news in receiver.handle_octets(&[octet?]) {
            // What is unknown is not reported: the attitude, and the position without a fix.
            let mut pose = ReportGlobalPose::default();
            let mut pose_ext = ReportGlobalPoseExt::default();
            let sampled_at = match news {
                Navigation::Fix(fix) => {
                    let rms = (fix.deviation() * std::f64::consts::SQRT_2).min(100.0);
                    pose.set_latitude_deg(fix.latitude)?;
                    pose.set_longitude_deg(fix.longitude)?;
                    pose.set_position_rms_m(rms)?;
                    pose_ext.set_latitude_deg(fix.latitude)?;
                    pose_ext.set_longitude_deg(fix.longitude)?;
                    pose_ext.set_xy_position_rms_m(rms)?;
                    time_of(&fix)
                }
                Navigation::NoFix => SystemTime::now(),
                Navigation::Course(_) => continue,
            };
            rover.publish(pose, sampled_at).await?;
            rover.publish(pose_ext, sampled_at).await?;
        }
    }
    Ok(())
}

/// A fix has a time of day. Its date is the one that brings it closest to this host's clock.
fn time_of(fix: &Fix) -> SystemTime {
    let now = UNIX_EPOCH.elapsed().unwrap_or_default().as_secs_f64();
    let days = ((now - fix.time.as_secs_f64()) / 86_400.0).round();
    UNIX_EPOCH + Duration::from_secs_f64(days * 86_400.0) + fix.time
}
