//! Flags of the drivers that keep to operating zones.

use std::time::Duration;

use clap::Args;
use jaus_vehicle::motion::FenceConfig;

use crate::runtime::{between, duration_within};

/// Dimensions and delays of the vehicle at the edges of operating zones
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Operating zones")]
pub struct FenceFlags {
    /// The radius of the circle that covers the vehicle in metres, from 0 to 50
    #[arg(long, value_name = "M", default_value = "0.25", value_parser = |text: &str| between(text, 0.0, 50.0))]
    radius: f64,

    /// The distance to keep from the edge of a zone in metres, from 0 to 50
    #[arg(long, value_name = "M", default_value = "0.1", value_parser = |text: &str| between(text, 0.0, 50.0))]
    edge_margin: f64,

    /// The time from a measurement to the brakes, from 0s to 10s
    #[arg(long, value_name = "DURATION", default_value = "300ms", value_parser = |text: &str| duration_within(text, "0s", "10s"))]
    reaction: Duration,
}

impl From<FenceFlags> for FenceConfig {
    fn from(flags: FenceFlags) -> Self {
        Self {
            radius: flags.radius,
            margin: flags.edge_margin,
            reaction: flags.reaction.as_secs_f64(),
        }
    }
}
