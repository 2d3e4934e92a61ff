//! `jaus-local-pose-sensor`: pose of a vehicle, by dead reckoning from wheel travel.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, seconds};
use jaus_cli::{Ready, launch};
use jaus_vehicle::motion::{Pose, wrap};
use jaus_vehicle::parts::{Part, PoseSensor};

#[derive(Args)]
struct Flags {
    /// Keep the pose in this file, and go on from there when started again
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,

    /// Where the vehicle is if nothing is kept: metres along X (north) and Y (east), and degrees
    /// clockwise from X
    #[arg(long, value_name = "X,Y,HEADING", default_value = "0,0,0", value_parser = pose, allow_hyphen_values = true)]
    at: Pose,

    /// How often to ask for the travel of the wheels, in hertz from 1 to 100
    #[arg(long, value_name = "HZ", default_value = "25", value_parser = |text: &str| between(text, 1.0, 100.0))]
    rate: f64,

    /// Tell no pose any more when the wheels have not been heard for so many seconds
    #[arg(long, value_name = "SECONDS", default_value = "0.3", value_parser = seconds)]
    silence: Duration,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-local-pose-sensor";
    const ABOUT: &'static str = "Tell where a vehicle is, reckoned from the travel of its wheels";
    const EXAMPLES: &'static str = "The wheels are found by Discovery: whoever offers Wheel Odometry in the same \
        subsystem, such as jaus-primitive-driver. A client that controls the sensor may tell it the pose.\n\nExamples:\n  \
        jaus-local-pose-sensor --loopback --state pose.toml   goes on where it was when started again\n  \
        jaus-local-pose-sensor --attach --at 10,-5,90         begins at x 10 m, y -5 m, looking east";
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
