//! `jaus-velocity-state-sensor`: velocity of a vehicle, from wheel travel.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, duration};
use jaus_cli::{Ready, launch};
use jaus_vehicle::parts::{Part, VelocitySensor};

#[derive(Args)]
struct Flags {
    /// How often to query wheel odometry, in hertz from 1 to 100
    #[arg(long, value_name = "HZ", default_value = "25", value_parser = |text: &str| between(text, 1.0, 100.0))]
    rate: f64,

    /// Stop reporting the velocity after this long without wheel odometry
    #[arg(long, value_name = "DURATION", default_value = "300ms", value_parser = duration)]
    silence: Duration,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-velocity-state-sensor";
    const ABOUT: &'static str = "Report a vehicle's velocity from wheel odometry";
    const EXAMPLES: &'static str = "Discovery finds a component with Wheel Odometry in the same \
        subsystem, such as jaus-primitive-driver.\n\nExamples:\n  \
        jaus-velocity-state-sensor --loopback   for trying it on one computer\n  \
        jaus-velocity-state-sensor --attach     on the node of this host";
    const ID: JausId = JausId::new(101, 42, 42);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(VelocitySensor {
            hz: self.rate,
            silence: self.silence,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
