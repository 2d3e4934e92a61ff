//! `jaus-imu-sensor`: rates of turn and acceleration of a vehicle, from an inertial measurement unit.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::duration;
use jaus_cli::{Ready, launch};
use jaus_vehicle::parts::{IioDevice, ImuSensor, Part};

#[derive(Args)]
struct Flags {
    /// The device: a directory of Linux's industrial I/O with in_anglvel_z_raw
    #[arg(
        long,
        value_name = "DIRECTORY",
        default_value = "/sys/bus/iio/devices/iio:device0"
    )]
    device: PathBuf,

    /// The device's Y axis points right and its Z axis down, not left and up. Its X axis points
    /// forward in any case
    #[arg(long)]
    inverted: bool,

    /// Report no values after this long without a measurement
    #[arg(long, value_name = "DURATION", default_value = "300ms", value_parser = duration)]
    silence: Duration,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-imu-sensor";
    const ABOUT: &'static str =
        "Report a vehicle's rates of turn and acceleration from an inertial measurement unit";
    const EXAMPLES: &'static str = "It reports the axes that the device has, 50 times a second: \
        yaw rate, roll and pitch rate, and linear acceleration.\n\nExamples:\n  \
        jaus-imu-sensor --loopback --device /sys/bus/iio/devices/iio:device1\n  \
        jaus-imu-sensor --attach --inverted    on the node of this host";
    const ID: JausId = JausId::new(101, 52, 52);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(ImuSensor {
            device: IioDevice {
                directory: self.device,
                inverted: self.inverted,
            },
            silence: self.silence,
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
