//! `jaus-global-driver`: drives a vehicle to waypoints and along headings on the globe.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, control_timeout, duration};
use jaus_cli::{FenceFlags, Ready, launch};
use jaus_vehicle::motion::Limits;
use jaus_vehicle::parts::{GlobalDriver, Part};

#[derive(Args)]
struct Flags {
    /// The vehicle's speed at full effort in m/s, from 0.05 to 20; half of that in reverse
    #[arg(long, value_name = "M/S", default_value = "2", value_parser = |text: &str| between(text, 0.05, 20.0))]
    speed: f64,

    /// The vehicle's turn rate at full effort in rad/s, from 0.05 to 10
    #[arg(long, value_name = "RAD/S", default_value = "1.5", value_parser = |text: &str| between(text, 0.05, 10.0))]
    yaw_rate: f64,

    /// The vehicle's least turning radius in metres, up to 100; 0 if it turns on the spot
    #[arg(long, value_name = "METRES", default_value = "0", value_parser = |text: &str| between(text, 0.0, 100.0))]
    turning_radius: f64,

    /// Deceleration before a waypoint in m/s², from 0.05 to 20
    #[arg(long, value_name = "M/S²", default_value = "1", value_parser = |text: &str| between(text, 0.05, 20.0))]
    deceleration: f64,

    /// Stop when pose or velocity is older than this
    #[arg(long, value_name = "DURATION", default_value = "600ms", value_parser = duration)]
    stale: Duration,

    /// Stop when the standard error of the position exceeds this, in metres from 0.01 to 100
    #[arg(long, value_name = "METRES", default_value = "5", value_parser = |text: &str| between(text, 0.01, 100.0))]
    max_rms: f64,

    /// The authority used to control the primitive driver
    #[arg(long, value_name = "CODE", default_value = "100")]
    authority: u8,

    /// Control ends unless the client renews it within this time, in whole seconds to 255s; `never` to
    /// keep it
    #[arg(long, value_name = "DURATION", default_value = "3s", value_parser = control_timeout)]
    control_timeout: u8,

    #[command(flatten)]
    fence: FenceFlags,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-global-driver";
    const ABOUT: &'static str = "Drive a vehicle to waypoints and along headings on the globe by commanding its primitive \
         driver";
    const EXAMPLES: &'static str = "Discovery finds the primitive driver, the global pose sensor \
        and the velocity state sensor in the same subsystem; they may start in any \
        order.\n\nExamples:\n  \
        jaus-global-driver --loopback               for trying it on one computer\n  \
        jaus-global-driver --attach --max-rms 0.5   only with a precise position";
    const ID: JausId = JausId::new(101, 46, 46);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(GlobalDriver {
            limits: Limits {
                speed: self.speed,
                reverse: self.speed / 2.0,
                yaw_rate: self.yaw_rate,
                turning_radius: self.turning_radius,
                deceleration: self.deceleration,
                ..Limits::default()
            },
            stale: self.stale,
            fence: self.fence.into(),
            max_rms: self.max_rms,
            authority: self.authority,
            control_timeout: self.control_timeout,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
