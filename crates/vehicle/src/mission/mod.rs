//! Missions: path planning over a map, and the sequence of stages that drives the path.
//!
//! [`plan`] finds a [`Path`] over a [`Terrain`]. A [`Mission`] is a state machine. It has the map
//! fetched, and the path planned, approved, handed to the path segment driver and driven. When a
//! stage is blocked it starts over. Neither does I/O, reads a clock or depends on messages.

mod barred;
mod bends;
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
pub use path::{Footprint, NoPath, Path, Point, blocked_after, plan};
pub use terrain::{Terrain, TerrainError};
pub use waterfall::{
    Action, Destination, Link, LinkState, Mission, NotPlanned, Refusal, Report, Run, Settings,
    Stage,
};
