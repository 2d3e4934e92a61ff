//! The reference ground vehicle: everything above the JAUS stack that a vehicle needs to drive a
//! mission.
//!
//! | module | contents |
//! |---|---|
//! | [`motion`] | a platform, real or simulated, and the motion control over it |
//! | [`navigation`] | the pose on the globe from GNSS, gyroscope and wheel travel |
//! | [`actuator`] | wheels and what turns them: a simulated motor, stepper motors on GPIO lines |
//! | [`zones`] | areas to stay in or keep out of |
//! | [`sensing`] | scans of a range sensor, real or simulated, and the obstacles that they show |
//! | [`world`] | vector objects and raster maps, their index and their file |
//! | [`mission`] | path planning over a map, and the stages of a mission |
//! | [`mobility`] | the services of the mobility set (AS6009), which command a [`motion::Pilot`] |
//! | [`ground`] | this project's own services: world model, missions, stages, odometry |
//! | [`handoff`] | handing over control to another operator on request |
//! | [`parts`] | complete components, one per program |
//!
//! `mobility`, `ground`, `handoff` and the modules below them open no sockets and read no clocks.
#![forbid(unsafe_code)]

pub mod actuator;
pub mod ground;
pub mod handoff;
pub mod messages;
pub mod mission;
pub mod mobility;
pub mod motion;
pub mod navigation;
pub mod parts;
pub mod sensing;
pub mod world;
pub mod zones;

/// Compiles the program in the guide to the vehicle.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/the-vehicle.md")]
struct TheVehicle;
