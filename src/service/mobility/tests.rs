//! The mobility services on a simulated vehicle, under virtual time.

mod sensors;

use std::time::Duration;

use super::*;
use crate::service::State;
use crate::service::rig::{CLIENT, Rig, STRANGER};
use crate::vehicle::{Frame, Pilot, SkidSteer, SkidSteerConfig};

/// Berlin, where the vehicle of the tests stands.
const FRAME: (f64, f64) = (52.5, 13.4);

fn vehicle() -> Vehicle {
    let rover = SkidSteer::new(SkidSteerConfig::default());
    Vehicle::new(Pilot::new(rover, Frame::at(FRAME.0, FRAME.1)))
}

/// All services on one vehicle, Ready and controlled by [`CLIENT`].
fn rig() -> (Rig, Vehicle) {
    let vehicle = vehicle();
    let services = [
        vehicle.velocity_state_sensor(),
        vehicle.acceleration_state_sensor(),
        vehicle.local_pose_sensor(),
        vehicle.global_pose_sensor(),
        vehicle.primitive_driver(),
    ];
    let boxed = |service| Box::new(service) as Box<dyn crate::service::Service>;
    let rig = Rig::new(services.into_iter().map(boxed).collect());
    // 2015-06-08 01:02:03.004 UTC.
    let since_1970 = Duration::from_millis(1_433_725_323_004);
    let vehicle = vehicle.with_time(rig.now, since_1970);
    (rig, vehicle)
}

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}
