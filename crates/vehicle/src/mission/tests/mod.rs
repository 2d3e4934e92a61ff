//! Tests of planning and of the mission state machine.

mod detours;
mod lost_link;
mod paths;
mod stages;
mod zones;
