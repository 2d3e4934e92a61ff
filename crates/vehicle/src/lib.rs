//! The reference ground vehicle: what it takes beyond a JAUS stack to make a vehicle drive a mission.
//!
//! | module | contents |
//! |---|---|
//! | [`motion`] | a platform, real or simulated, and the motion control over it |
//! | [`actuator`] | wheels and what turns them: a simulated motor, stepper motors on GPIO lines |
//! | [`world`] | vector objects and raster maps, their index, and the file that keeps them |
//! | [`mission`] | path planning over a map, and the stages of a mission |
//! | [`mobility`] | the services of the mobility set (AS6009), which command a [`motion::Pilot`] |
//! | [`ground`] | our own services: world model, missions, stages, odometry |
//! | [`parts`] | ready components, each of which a program runs |
//!
//! From `mobility` and `ground` down, nothing opens a socket or reads a clock.
#![forbid(unsafe_code)]

pub mod actuator;
pub mod ground;
pub mod messages;
pub mod mission;
pub mod mobility;
pub mod motion;
pub mod parts;
pub mod world;
