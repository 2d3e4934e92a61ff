//! Missions: a path to a destination over a map, and the waterfall of stages that drives it.
//!
//! [`plan`] finds a [`Path`] over a [`Terrain`]. A [`Mission`] is a state machine that has the map
//! fetched, the path planned, approved, handed to the path segment driver and driven, stage after
//! stage, and begins again when a stage is blocked. Neither does I/O or reads a clock, and neither
//! knows a message.

mod blocks;
mod ground;
mod lost_link;
mod path;
mod search;
mod sight;
mod terrain;
#[cfg(test)]
mod tests;
mod waterfall;

pub use lost_link::LostLink;
pub use path::{NoPath, Path, Point, Vehicle, plan};
pub use terrain::{Terrain, TerrainError};
pub use waterfall::{
    Action, Destination, Link, LinkState, Mission, NotPlanned, Refusal, Report, Run, Settings,
    Stage,
};
