//! Tests of planning and of the waterfall.

mod paths;
mod stages;
