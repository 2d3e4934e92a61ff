//! `jaus-planner`: plans missions over the map and executes them.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::{Ready, launch, runtime};
use jaus_vehicle::mission::{Footprint, LostLink, Settings};
use jaus_vehicle::parts::{Part, Planner};

#[derive(Args)]
struct Flags {
    /// The vehicle's width in metres, from 0 to 100
    #[arg(long, value_name = "METRES", default_value = "0.6", value_parser = |text: &str| between(text, 0.0, 100.0))]
    width: f64,

    /// Clearance to keep on each side, in metres, from 0 to 100
    #[arg(long, value_name = "METRES", default_value = "0.1", value_parser = |text: &str| between(text, 0.0, 100.0))]
    margin: f64,

    /// The vehicle's least turning radius in metres, up to 100; 0 if it turns on the spot
    #[arg(long, value_name = "METRES", default_value = "0", value_parser = |text: &str| between(text, 0.0, 100.0))]
    turning_radius: f64,

    /// The maximum speed in m/s, from 0.01 to 100, for missions that set none
    #[arg(long, value_name = "M/S", default_value = "1", value_parser = |text: &str| between(text, 0.01, 100.0))]
    speed: f64,

    /// Cross-track tolerance: the allowed distance from a segment's line, in metres, from 0.01 to
    /// 10
    #[arg(long, value_name = "METRES", default_value = "0.3", value_parser = |text: &str| between(text, 0.01, 10.0))]
    tolerance: f64,

    /// The name of the map to plan on; if the store has only one map, that one is used
    #[arg(long, value_name = "NAME", default_value = "traversability")]
    map: String,

    /// The maximum number of attempts at a mission before the vehicle has been sent off
    #[arg(long, value_name = "COUNT", default_value = "3", value_parser = clap::value_parser!(u8).range(1..))]
    attempts: u8,

    /// How often the vehicle drives on by itself after a fault has stopped it; at 0 the mission waits
    /// until the operator continues it
    #[arg(long, value_name = "COUNT", default_value = "0")]
    retries: u8,

    /// The time to wait after a blocked attempt
    #[arg(long, value_name = "DURATION", default_value = "3s", value_parser = runtime::duration)]
    pause: Duration,

    /// The time a stage may take to start or to recover
    #[arg(long, value_name = "DURATION", default_value = "15s", value_parser = runtime::duration)]
    timeout: Duration,

    /// The time the vehicle may drive without progress
    #[arg(long, value_name = "DURATION", default_value = "1min", value_parser = runtime::duration)]
    stall: Duration,

    /// The maximum number of new paths in one attempt because the map has changed on the way
    #[arg(long, value_name = "COUNT", default_value = "10")]
    detours: u8,

    /// What to do when the operator's link is lost: stop; hold position and keep the mission for a
    /// new operator's approval; or return along the driven path
    #[arg(long, value_name = "POLICY", default_value = "stop", value_parser = lost_link)]
    lost_link: LostLink,

    /// The authority used to control the path segment driver; an operator with a higher one can
    /// take over
    #[arg(long, value_name = "CODE", default_value = "100")]
    authority: u8,

    /// The minimum authority an operator needs to control the planner
    #[arg(long, value_name = "CODE", default_value = "1")]
    least_authority: u8,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-planner";
    const ABOUT: &'static str = "Plan missions on the map and execute them";
    const EXAMPLES: &'static str = "\
        It finds the knowledge store, the pose sensor and the drivers in its own subsystem; they \
        may start in any order.\nAn operator takes control of it, sets a destination and approves \
        the path.\n\n\
        Examples:\n  \
        jaus-planner --loopback               for trying it on one computer\n  \
        jaus-planner --attach                 on the node of this host (jaus-communicator --local)\n  \
        jaus-planner --width 1.2 --margin 0.3 for a larger vehicle\n  \
        jaus-planner --config planner.toml    flags from a file: in [component], width = 1.2";
    const ID: JausId = JausId::new(101, 36, 36);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(Planner {
            vehicle: Footprint {
                width: self.width,
                margin: self.margin,
                turning_radius: self.turning_radius,
            },
            mission: Settings {
                attempts: self.attempts,
                retries: self.retries,
                pause: self.pause,
                patience: self.timeout,
                stall: self.stall,
                detours: self.detours,
                speed: self.speed,
                lost_link: self.lost_link,
                ..Settings::default()
            },
            map: self.map,
            authority: self.authority,
            least_authority: self.least_authority,
            tolerance: self.tolerance,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}

/// Reads a flag's number between two bounds.
fn between(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("write a number from {least} to {most}")),
    }
}

fn lost_link(text: &str) -> Result<LostLink, String> {
    match text {
        "stop" => Ok(LostLink::Stop),
        "hold" => Ok(LostLink::Hold),
        "return" => Ok(LostLink::Return),
        _ => Err("write stop, hold or return".to_owned()),
    }
}
