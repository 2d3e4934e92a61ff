//! Tests of planning and of the mission state machine.

mod lost_link;
mod paths;
mod stages;
