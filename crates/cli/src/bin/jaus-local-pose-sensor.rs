//! `jaus-local-pose-sensor`: pose of a vehicle, by dead reckoning from wheel travel.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, duration};
use jaus_cli::{Ready, launch};
use jaus_vehicle::motion::{Pose, wrap};
use jaus_vehicle::parts::{Part, PoseSensor};

#[derive(Args)]
struct Flags {
    /// Save the pose to this file and restore it at the next start
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,

    /// The initial pose if none was saved: X (north) and Y (east) in metres, and degrees clockwise
    /// from X
    #[arg(long, value_name = "X,Y,HEADING", default_value = "0,0,0", value_parser = pose, allow_hyphen_values = true)]
    at: Pose,

    /// How often to query wheel odometry, in hertz from 1 to 100
    #[arg(long, value_name = "HZ", default_value = "25", value_parser = |text: &str| between(text, 1.0, 100.0))]
    rate: f64,

    /// Stop reporting the pose after this long without wheel odometry
    #[arg(long, value_name = "DURATION", default_value = "300ms", value_parser = duration)]
    silence: Duration,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-local-pose-sensor";
    const ABOUT: &'static str = "Report a vehicle's local pose from wheel odometry";
    const EXAMPLES: &'static str = "Discovery finds a component with Wheel Odometry in the same \
        subsystem, such as jaus-primitive-driver. The client in control of the sensor may set the \
        pose.\n\nExamples:\n  \
        jaus-local-pose-sensor --loopback --state pose.toml   restores the pose after a restart\n  \
        jaus-local-pose-sensor --attach --at 10,-5,90         x 10 m, y -5 m, heading east";
    const ID: JausId = JausId::new(101, 41, 41);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(PoseSensor {
            file: self.state,
            start: self.at,
            hz: self.rate,
            silence: self.silence,
        })
    }
}

/// Maximum of X and Y in metres: the range of Set Local Pose.
const MOST: f64 = 100_000.0;

/// Parses a pose: `10,-5,90`.
fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map_while(|it| it.trim().parse().ok())
        .collect();
    match numbers[..] {
        [x, y, heading] if x.abs() <= MOST && y.abs() <= MOST && heading.abs() <= 360.0 => {
            Ok(Pose {
                yaw: wrap(heading.to_radians()),
                ..Pose::at(x, y)
            })
        }
        _ => Err(
            "write metres, metres and degrees such as 10,-5,90, within 100 km and one turn"
                .to_owned(),
        ),
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
