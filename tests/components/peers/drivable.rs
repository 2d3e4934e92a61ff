//! Components that replace recorded ones.

use jaus::address::JausId;
use jaus::service::{
    Discovery, Kind, Liveness, Management, Profile, Scope, Service, Stack, Timing, Transport,
};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Limits, Pilot, SkidSteer, SkidSteerConfig};

/// A component that can be controlled and driven, like `jaus vehicle`.
pub(crate) fn vehicle(id: JausId) -> Stack {
    let platform = SkidSteer::new(SkidSteerConfig {
        limits: Limits::default(),
        noise: 0.0,
        seed: 1,
    });
    let vehicle = Vehicle::new(Pilot::new(platform, Frame::default()));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(Transport),
        Box::new(Liveness::new()),
        Box::new(vehicle.list_manager()),
        Box::new(vehicle.velocity_state_sensor()),
        Box::new(vehicle.local_pose_sensor()),
        Box::new(vehicle.global_pose_sensor()),
        Box::new(vehicle.primitive_driver()),
        Box::new(vehicle.local_waypoint_driver()),
        Box::new(vehicle.local_waypoint_list_driver()),
    ];
    Stack::new(discovery(id, Kind::Vehicle, "Rover"), services).management(Management::new())
}

/// A component that discovers others and cannot be controlled.
pub(crate) fn operator(id: JausId) -> Stack {
    let services: Vec<Box<dyn Service>> = vec![Box::new(Transport), Box::new(Liveness::new())];
    Stack::new(
        discovery(id, Kind::OperatorControlUnit, "Station"),
        services,
    )
}

fn discovery(id: JausId, kind: Kind, name: &str) -> Discovery {
    let profile = Profile::new(kind, name);
    Discovery::new(
        id,
        profile,
        Scope::System,
        Timing::default(),
        id.to_u32().into(),
    )
}
