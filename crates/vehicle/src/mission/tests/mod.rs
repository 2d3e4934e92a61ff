//! Tests of planning and of the waterfall.

mod lost_link;
mod paths;
mod stages;
