//! `jaus-local-vector-driver`: keeps the speed and the heading of a vehicle.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, control_timeout, duration};
use jaus_cli::{FenceFlags, Ready, launch};
use jaus_vehicle::motion::Limits;
use jaus_vehicle::parts::{Part, VectorDriver};

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

    /// The maximum acceleration in m/s², from 0.05 to 20; it brakes twice as hard
    #[arg(long, value_name = "M/S²", default_value = "1", value_parser = |text: &str| between(text, 0.05, 20.0))]
    acceleration: f64,

    /// Stop when no command arrives for this long
    #[arg(long, value_name = "DURATION", default_value = "1s", value_parser = duration)]
    silence: Duration,

    /// Stop when pose or velocity is older than this
    #[arg(long, value_name = "DURATION", default_value = "600ms", value_parser = duration)]
    stale: Duration,

    /// The authority used to control the primitive driver
    #[arg(long, value_name = "CODE", default_value = "100")]
    authority: u8,

    /// Control ends unless the client renews it within this time, in whole seconds to 255s; `never` to
    /// keep it
    #[arg(long, value_name = "DURATION", default_value = "3s", value_parser = control_timeout)]
    control_timeout: u8,

    /// Do not drive without a range sensor. Without this flag it is needed from its first scan on
    #[arg(long)]
    needs_range_sensor: bool,

    #[command(flatten)]
    fence: FenceFlags,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-local-vector-driver";
    const ABOUT: &'static str =
        "Control a vehicle's speed and heading by commanding its primitive driver";
    const EXAMPLES: &'static str = "Discovery finds the primitive driver, the local pose sensor \
        and the velocity state sensor in the same subsystem; they may start in any \
        order.\n\nExamples:\n  \
        jaus-local-vector-driver --loopback            for trying it on one computer\n  \
        jaus-local-vector-driver --attach              on the node of this host\n  \
        jaus-local-vector-driver --speed 1 --stale 1   a slow vehicle with slow sensors";
    const ID: JausId = JausId::new(101, 44, 44);

    fn part(self) -> Result<impl Part, Failure> {
        let usual = Limits::default();
        Ok(VectorDriver {
            limits: Limits {
                speed: self.speed,
                reverse: self.speed / 2.0,
                yaw_rate: self.yaw_rate,
                acceleration: self.acceleration,
                deceleration: 2.0 * self.acceleration,
                turning_radius: self.turning_radius,
                ..usual
            },
            silence: self.silence,
            stale: self.stale,
            authority: self.authority,
            fence: self.fence.into(),
            needs_range_sensor: self.needs_range_sensor,
            control_timeout: self.control_timeout,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
