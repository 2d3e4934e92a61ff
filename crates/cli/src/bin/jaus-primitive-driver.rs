//! `jaus-primitive-driver`: the wheels of a vehicle, simulated or on stepper motors.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, seconds};
use jaus_cli::{FenceFlags, Ready, launch};
use jaus_vehicle::actuator::{MotorConfig, WheelsConfig};
use jaus_vehicle::motion::Limits;
use jaus_vehicle::parts::{Motors, Part, PrimitiveDriver, Stop};

#[derive(Args)]
struct Flags {
    /// The speed at full effort in m/s, from 0.05 to 20; half of that in reverse
    #[arg(long, value_name = "M/S", default_value = "2", value_parser = |text: &str| between(text, 0.05, 20.0))]
    speed: f64,

    /// The turn rate at full effort in rad/s, from 0.05 to 10
    #[arg(long, value_name = "RAD/S", default_value = "1.5", value_parser = |text: &str| between(text, 0.05, 10.0))]
    yaw_rate: f64,

    /// The effective track width between left and right wheels in metres, from 0.05 to 10
    #[arg(long, value_name = "M", default_value = "0.5", value_parser = |text: &str| between(text, 0.05, 10.0))]
    track: f64,

    /// Command timeout in seconds: stop the motors when no effort arrives for this long
    #[arg(long, value_name = "SECONDS", default_value = "0.5", value_parser = seconds)]
    silence: Duration,

    /// Motor watchdog in seconds: the motors brake if the program hangs and stops repeating its
    /// command
    #[arg(long, value_name = "SECONDS", default_value = "0.2", value_parser = seconds)]
    deadline: Duration,

    /// Control timeout in seconds: control ends unless the client renews it; 0 for never
    #[arg(long, value_name = "SECONDS", default_value = "3")]
    control_timeout: u8,

    #[command(flatten)]
    fence: FenceFlags,

    /// Stop while this file exists: a simulated stop input
    #[arg(long, value_name = "FILE")]
    stop_file: Option<PathBuf>,

    #[command(flatten)]
    simulation: Simulation,

    #[cfg(all(feature = "gpio", target_os = "linux"))]
    #[command(flatten)]
    gpio: gpio::Gpio,
}

#[derive(Args)]
#[command(next_help_heading = "Simulated motors")]
struct Simulation {
    /// The motors' time constant in seconds, from 0.01 to 10
    #[arg(long, value_name = "SECONDS", default_value = "0.25", value_parser = |text: &str| between(text, 0.01, 10.0))]
    response: f64,

    /// How unequal the motors are, as a fraction of their strength from 0 to 0.5
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = |text: &str| between(text, 0.0, 0.5))]
    noise: f64,

    /// Random seed of --noise: the same seed gives the same motors
    #[arg(long, default_value = "1")]
    seed: u64,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-primitive-driver";
    const ABOUT: &'static str = "Drive a vehicle's wheels with the efforts its client sets, and \
        report wheel odometry";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-primitive-driver --loopback            simulated wheels, for trying it\n  \
        jaus-primitive-driver --attach              on the node of this host\n  \
        jaus-primitive-driver --noise 0.1 --seed 7  with unequal motors";
    const ID: JausId = JausId::new(101, 33, 33);

    fn part(self) -> Result<impl Part, Failure> {
        Ok(PrimitiveDriver {
            motors: self.motors(),
            stop: self.stop(),
            wheels: WheelsConfig {
                track: self.track,
                top: self.speed,
                limits: Limits {
                    speed: self.speed,
                    reverse: self.speed / 2.0,
                    yaw_rate: self.yaw_rate,
                    ..Limits::default()
                },
            },
            silence: self.silence,
            fence: self.fence.into(),
            control_timeout: self.control_timeout,
        })
    }
}

impl Flags {
    fn stop(&self) -> Option<Stop> {
        #[cfg(all(feature = "gpio", target_os = "linux"))]
        if let Some((chip, line)) = self.gpio.stop_line.clone() {
            return Some(Stop::Gpio { chip, line });
        }
        self.stop_file.clone().map(Stop::File)
    }

    fn motors(&self) -> Motors {
        #[cfg(all(feature = "gpio", target_os = "linux"))]
        if let Some(motors) = self.gpio.motors(self.speed, self.deadline) {
            return Motors::Gpio(motors);
        }
        Motors::Simulated(MotorConfig {
            top: self.speed,
            response: self.simulation.response,
            noise: self.simulation.noise,
            seed: self.simulation.seed,
            deadline: self.deadline,
            ..MotorConfig::default()
        })
    }
}

#[cfg(all(feature = "gpio", target_os = "linux"))]
mod gpio {
    use std::path::PathBuf;
    use std::time::Duration;

    use clap::Args;
    use jaus_cli::runtime::between;
    use jaus_vehicle::actuator::StepperConfig;
    use jaus_vehicle::parts::GpioMotors;

    #[derive(Args)]
    #[command(next_help_heading = "Stepper motors on GPIO lines")]
    pub(super) struct Gpio {
        /// The GPIO chip of the motor drivers, such as /dev/gpiochip0 [default: simulated motors]
        #[arg(long, value_name = "CHIP", requires_all = ["left", "right"])]
        gpio: Option<PathBuf>,

        /// The left motor's lines: step, direction
        #[arg(long, value_name = "STEP,DIRECTION", value_parser = lines, requires = "gpio")]
        left: Option<(u32, u32)>,

        /// The right motor's lines; that motor is mounted mirrored
        #[arg(long, value_name = "STEP,DIRECTION", value_parser = lines, requires = "gpio")]
        right: Option<(u32, u32)>,

        /// A stop input: a normally closed contact between this line and ground, such as
        /// /dev/gpiochip0:5. An open contact or a broken wire stops the motors; closing it again
        /// clears all emergencies
        #[arg(long, value_name = "CHIP:LINE", value_parser = chip_and_line, conflicts_with = "stop_file")]
        pub(super) stop_line: Option<(PathBuf, u32)>,

        /// Step pulses per metre of travel, from 1 to 1000000
        #[arg(long, value_name = "PULSES", default_value = "2546", value_parser = |text: &str| between(text, 1.0, 1e6))]
        steps_per_metre: f64,

        /// The maximum acceleration without lost steps in m/s², from 0.01 to 100; twice that when
        /// braking
        #[arg(long, value_name = "M/S²", default_value = "1", value_parser = |text: &str| between(text, 0.01, 100.0))]
        ramp: f64,
    }

    impl Gpio {
        pub(super) fn motors(&self, top: f64, deadline: Duration) -> Option<GpioMotors> {
            Some(GpioMotors {
                chip: self.gpio.clone()?,
                stepper: StepperConfig {
                    steps_per_metre: self.steps_per_metre,
                    top,
                    acceleration: self.ramp,
                    deceleration: 2.0 * self.ramp,
                    deadline,
                },
                left: self.left?,
                right: self.right?,
            })
        }
    }

    fn chip_and_line(text: &str) -> Result<(PathBuf, u32), String> {
        let pair = text.rsplit_once(':').filter(|(chip, _)| !chip.is_empty());
        pair.and_then(|(chip, line)| Some((PathBuf::from(chip), line.parse().ok()?)))
            .ok_or_else(|| "write a chip and a line number such as /dev/gpiochip0:5".to_owned())
    }

    fn lines(text: &str) -> Result<(u32, u32), String> {
        let number = |text: &str| text.trim().parse::<u32>().ok();
        let pair = text.split_once(',');
        let pair = pair.and_then(|(step, direction)| Some((number(step)?, number(direction)?)));
        pair.filter(|(step, direction)| step != direction)
            .ok_or_else(|| "write two different line numbers such as 17,27".to_owned())
    }
}

fn main() -> ExitCode {
    launch::<Flags>()
}
