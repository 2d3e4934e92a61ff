//! `jaus-global-pose-sensor`: pose of a vehicle on the globe, from a GNSS receiver, a gyroscope and
//! wheel travel.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, duration};
use jaus_cli::{Ready, launch};
use jaus_vehicle::motion::wrap;
use jaus_vehicle::navigation::NavigatorConfig;
use jaus_vehicle::parts::{GlobalPoseSensor, Gyro, IioDevice, Part};

#[derive(Args)]
struct Flags {
    /// The serial line of the GNSS receiver (NMEA 0183: GGA, and RMC or VTG)
    #[arg(long, value_name = "DEVICE", default_value = "/dev/ttyACM0")]
    receiver: String,

    /// Bits per second of the receiver's line
    #[arg(long, value_name = "BAUD", default_value = "9600", value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,

    /// The gyroscope: a directory of Linux's industrial I/O, such as
    /// /sys/bus/iio/devices/iio:device0, with its Z axis vertical [default: none]
    #[arg(long, value_name = "DIRECTORY")]
    gyro: Option<PathBuf>,

    /// The gyroscope's Z axis points down
    #[arg(long, requires = "gyro")]
    gyro_inverted: bool,

    /// Take the turn rate from the IMU of the same subsystem: a component that reports a yaw rate and
    /// no velocity, such as jaus-imu-sensor. While it is lost, the wheels turn the heading
    #[arg(long, conflicts_with = "gyro")]
    imu: bool,

    /// The initial heading in degrees from true north [default: unknown until the vehicle has moved]
    #[arg(long, value_name = "DEGREES", value_parser = |text: &str| between(text, -360.0, 360.0), allow_hyphen_values = true)]
    heading: Option<f64>,

    /// How often to query wheel odometry and the IMU, in hertz from 1 to 100
    #[arg(long, value_name = "HZ", default_value = "25", value_parser = |text: &str| between(text, 1.0, 100.0))]
    rate: f64,

    /// Stop reporting the pose after this long without position and wheel odometry
    #[arg(long, value_name = "DURATION", default_value = "1.5s", value_parser = duration)]
    silence: Duration,

    /// Stop reporting the pose after this long without an acceptable position, whatever the
    /// wheels say: they also turn where the vehicle is stuck
    #[arg(long, value_name = "DURATION", default_value = "10s", value_parser = duration)]
    outage: Duration,

    /// Stop reporting the pose when the standard error of the position exceeds this, in metres from
    /// 0.01 to 100
    #[arg(long, value_name = "METRES", default_value = "10", value_parser = |text: &str| between(text, 0.01, 100.0))]
    max_rms: f64,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-global-pose-sensor";
    const ABOUT: &'static str =
        "Report a vehicle's pose on the globe from satellites, a gyroscope and wheel odometry";
    const EXAMPLES: &'static str = "Discovery finds a component with Wheel Odometry in the same \
        subsystem, such as jaus-primitive-driver. Without one, the pose is that of the receiver. \
        The client in control of the sensor may set the heading.\n\nExamples:\n  \
        jaus-global-pose-sensor --loopback --receiver /dev/ttyUSB0 --baud 115200\n  \
        jaus-global-pose-sensor --attach --gyro /sys/bus/iio/devices/iio:device0 --heading 90\n  \
        jaus-global-pose-sensor --attach --imu";
    const ID: JausId = JausId::new(101, 43, 43);

    fn part(self) -> Result<impl Part, Failure> {
        let inverted = self.gyro_inverted;
        Ok(GlobalPoseSensor {
            receiver: self.receiver,
            baud: self.baud,
            gyro: match self.gyro {
                Some(directory) => Some(Gyro::Device(IioDevice {
                    directory,
                    inverted,
                })),
                None => self.imu.then_some(Gyro::Component),
            },
            hz: self.rate,
            navigator: NavigatorConfig {
                heading: self.heading.map(|degrees| wrap(degrees.to_radians())),
                silence: self.silence,
                outage: self.outage,
                max_rms: self.max_rms,
            },
        })
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
