//! `jaus-local-path-segment-driver`: drives a vehicle along the segments of a list.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, control_timeout, duration};
use jaus_cli::{FenceFlags, Ready, launch};
use jaus_vehicle::motion::Limits;
use jaus_vehicle::parts::{Part, PathDriver};

#[derive(Args)]
struct Flags {
    /// The maximum speed in m/s, from 0.05 to 20, whatever the path asks for
    #[arg(long, value_name = "M/S", default_value = "2", value_parser = |text: &str| between(text, 0.05, 20.0))]
    speed: f64,

    /// The maximum turn rate in rad/s, from 0.05 to 10; the vehicle slows down in tighter curves
    #[arg(long, value_name = "RAD/S", default_value = "1.5", value_parser = |text: &str| between(text, 0.05, 10.0))]
    yaw_rate: f64,

    /// The vehicle's least turning radius in metres, up to 100; 0 if it turns on the spot
    #[arg(long, value_name = "METRES", default_value = "0", value_parser = |text: &str| between(text, 0.0, 100.0))]
    turning_radius: f64,

    /// Deceleration before the end of the path in m/s², from 0.05 to 20
    #[arg(long, value_name = "M/S²", default_value = "1", value_parser = |text: &str| between(text, 0.05, 20.0))]
    deceleration: f64,

    /// Stop when the pose is older than this
    #[arg(long, value_name = "DURATION", default_value = "600ms", value_parser = duration)]
    stale: Duration,

    /// The authority used to control the vector driver
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
    const PROGRAM: &'static str = "jaus-local-path-segment-driver";
    const ABOUT: &'static str =
        "Drive a vehicle along a list of path segments by commanding its vector driver";
    const EXAMPLES: &'static str = "Discovery finds the vector driver and the local pose sensor \
        in the same subsystem; they may start in any order. Clients set the list (List Manager) \
        and execute it.\n\nExamples:\n  \
        jaus-local-path-segment-driver --loopback   for trying it on one computer\n  \
        jaus-local-path-segment-driver --attach     on the node of this host";
    const ID: JausId = JausId::new(101, 48, 48);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(PathDriver {
            limits: Limits {
                speed: self.speed,
                yaw_rate: self.yaw_rate,
                deceleration: self.deceleration,
                turning_radius: self.turning_radius,
                ..Limits::default()
            },
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
