//! `jaus-range-sensor`: a simulated range sensor among round obstacles.

use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::between;
use jaus_cli::{Ready, launch};
use jaus_vehicle::parts::{Part, RangeSensor};
use jaus_vehicle::sensing::{Disc, RangerConfig, Scenery};

#[derive(Args)]
struct Flags {
    /// A round obstacle: X (north), Y (east) and radius in metres, such as 3,-1,0.5; repeat the flag
    /// for more
    #[arg(long, value_name = "X,Y,RADIUS", value_parser = disc, allow_hyphen_values = true)]
    obstacle: Vec<Disc>,

    /// The greatest distance that it measures in metres, from 7 to 1000. Drivers take all distances
    /// below 6 m for obstacles
    #[arg(long, value_name = "M", default_value = "8", value_parser = |text: &str| between(text, 7.0, 1000.0))]
    reach: f64,

    /// The field of view about the vehicle's heading in degrees, from 1 to 360
    #[arg(long, value_name = "DEGREES", default_value = "270", value_parser = |text: &str| between(text, 1.0, 360.0))]
    field_of_view: f64,

    /// The number of rays in the field of view, from 2 to 720
    #[arg(long, value_name = "COUNT", default_value = "181", value_parser = clap::value_parser!(u16).range(2..=720))]
    rays: u16,

    /// Measurements per second, from 1 to 50
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = |text: &str| between(text, 1.0, 50.0))]
    rate: f64,

    /// The standard deviation of a distance in metres, from 0 to 10
    #[arg(long, value_name = "M", default_value = "0.02", value_parser = |text: &str| between(text, 0.0, 10.0))]
    noise: f64,

    /// Random seed of --noise
    #[arg(long, default_value = "1")]
    seed: u64,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-range-sensor";
    const ABOUT: &'static str = "Report the distances to simulated obstacles around a vehicle";
    const EXAMPLES: &'static str = "Discovery finds the local pose sensor in the same subsystem. \
        The drivers and the planner find the range sensor, and need it from its first scan \
        on.\n\nExamples:\n  \
        jaus-range-sensor --loopback --obstacle 3,0,0.3   for trying it on one computer\n  \
        jaus-range-sensor --attach --field-of-view 360    on the node of this host";
    const ID: JausId = JausId::new(101, 51, 51);

    fn part(self) -> Result<impl Part, Failure> {
        let scenery = Scenery::default();
        scenery.set(self.obstacle);
        Ok(RangeSensor {
            ranger: RangerConfig {
                reach: self.reach,
                field_of_view: self.field_of_view.to_radians(),
                rays: self.rays,
                noise: self.noise,
                seed: self.seed,
            },
            scenery,
            hz: self.rate,
        })
    }
}

/// Parses an obstacle: `3,-1,0.5`.
fn disc(text: &str) -> Result<Disc, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map_while(|it| it.trim().parse().ok())
        .collect();
    match numbers[..] {
        [x, y, radius]
            if [x, y].iter().all(|it| it.abs() <= 1e5) && (0.0..=1e3).contains(&radius) =>
        {
            Ok(Disc {
                middle: (x, y),
                radius,
            })
        }
        _ => Err("write three numbers of metres such as 3,-1,0.5, within 100 km".to_owned()),
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
