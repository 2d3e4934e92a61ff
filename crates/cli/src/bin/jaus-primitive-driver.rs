//! `jaus-primitive-driver`: the wheels and the steering of a vehicle, simulated or real.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::Failure;
use jaus_cli::runtime::{between, control_timeout, duration, duration_within};
use jaus_cli::{FenceFlags, Ready, launch};
use jaus_vehicle::actuator::{MotorConfig, ServoConfig, WheelsConfig};
use jaus_vehicle::motion::{Ackermann, Limits};
use jaus_vehicle::parts::{
    self, HBridgeMotors, Motors, Part, PrimitiveDriver, Sabertooth, SteeringGear, Stop,
};

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

    /// The distance between the axles of a vehicle with steered front wheels, in metres, from 0.05 to
    /// 20. The left motor then drives the rear axle [default: no steering, a motor on each side]
    #[arg(long, value_name = "METRES", value_parser = |text: &str| between(text, 0.05, 20.0))]
    wheelbase: Option<f64>,

    /// The largest steering angle to either side in degrees, from 1 to 80
    #[arg(long, value_name = "DEGREES", default_value = "25", value_parser = |text: &str| between(text, 1.0, 80.0), requires = "wheelbase")]
    steering_angle: f64,

    /// Stop the motors when no effort arrives for this long
    #[arg(long, value_name = "DURATION", default_value = "500ms", value_parser = duration)]
    silence: Duration,

    /// The motors' watchdog: they brake if the program hangs and stops repeating its
    /// command
    #[arg(long, value_name = "DURATION", default_value = "200ms", value_parser = duration)]
    deadline: Duration,

    /// Control ends unless the client renews it within this time, in whole seconds to 255s; `never` to
    /// keep it
    #[arg(long, value_name = "DURATION", default_value = "3s", value_parser = control_timeout)]
    control_timeout: u8,

    #[command(flatten)]
    fence: FenceFlags,

    /// Stop while this file exists: a simulated stop input
    #[arg(long, value_name = "FILE")]
    stop_file: Option<PathBuf>,

    #[command(flatten)]
    simulation: Simulation,

    #[command(flatten)]
    servo: Servo,

    #[command(flatten)]
    controller: Controller,

    #[command(flatten)]
    bridges: Bridges,

    #[command(flatten)]
    can: can::Can,

    #[command(flatten)]
    gpio: gpio::Gpio,
}

#[derive(Args)]
#[command(next_help_heading = "Steering servo")]
struct Servo {
    /// The PWM output of the servo, such as /sys/class/pwm/pwmchip0:0 [default: a simulated servo]
    #[arg(long, value_name = "CHIP:OUTPUT", value_parser = chip_and_number, requires = "wheelbase")]
    servo: Option<(PathBuf, u32)>,

    /// The pulse length straight ahead in microseconds, from 500 to 2500
    #[arg(long, value_name = "MICROSECONDS", default_value = "1500", value_parser = clap::value_parser!(u16).range(500..=2500))]
    servo_centre: u16,

    /// How much longer the pulse is at the largest angle to the right, in microseconds, from -1000 to
    /// 1000; negative for a servo that turns the other way
    #[arg(long, value_name = "MICROSECONDS", default_value = "400", value_parser = clap::value_parser!(i32).range(-1000..=1000), allow_hyphen_values = true)]
    servo_swing: i32,

    /// How fast the servo turns, in degrees per second from 1 to 1000
    #[arg(long, value_name = "DEGREES/S", default_value = "115", value_parser = |text: &str| between(text, 1.0, 1000.0))]
    servo_rate: f64,
}

#[derive(Args)]
#[command(next_help_heading = "Sabertooth motor controller")]
struct Controller {
    /// The serial line of a motor controller with the left motor on output 1 and the right one on
    /// output 2, such as /dev/ttyUSB0. Without encoders, wheel travel is estimated from --speed and
    /// --response [default: simulated motors]
    #[arg(long, value_name = "DEVICE", group = "motors")]
    sabertooth: Option<String>,

    /// Bits per second of the controller's line
    #[arg(long, value_name = "BAUD", default_value = "9600", value_parser = clap::value_parser!(u32).range(2400..=115_200))]
    sabertooth_baud: u32,

    /// The controller's address, from 128 to 135
    #[arg(long, value_name = "ADDRESS", default_value = "128", value_parser = clap::value_parser!(u8).range(128..=135))]
    sabertooth_address: u8,
}

#[derive(Args)]
#[command(next_help_heading = "H-bridges on PWM outputs")]
struct Bridges {
    /// The PWM chip of the motors' H-bridges, such as /sys/class/pwm/pwmchip0. The outputs keep their
    /// duty cycle if the program is killed: run it with the package's systemd unit, which switches
    /// them off, and have an emergency stop in hardware [default: simulated motors]
    #[arg(long, value_name = "CHIP", requires_all = ["pwm_left", "pwm_right"], group = "motors")]
    pwm: Option<PathBuf>,

    /// The outputs of the left motor's bridge: ahead, back
    #[arg(long, value_name = "AHEAD,BACK", value_parser = pair, requires = "pwm")]
    pwm_left: Option<(u32, u32)>,

    /// The outputs of the right motor's bridge: ahead, back; the other way round for a motor that is
    /// mounted mirrored
    #[arg(long, value_name = "AHEAD,BACK", value_parser = pair, requires = "pwm")]
    pwm_right: Option<(u32, u32)>,

    /// Pulses per second, from 50 to 100000
    #[arg(long, value_name = "HZ", default_value = "20000", value_parser = |text: &str| between(text, 50.0, 1e5))]
    pwm_frequency: f64,
}

impl Bridges {
    fn motors(&self, motor: MotorConfig) -> Option<HBridgeMotors> {
        Some(HBridgeMotors {
            chip: self.pwm.clone()?,
            left: self.pwm_left?,
            right: self.pwm_right?,
            period: Duration::from_secs_f64(1.0 / self.pwm_frequency),
            motor,
        })
    }
}

#[derive(Args)]
#[command(next_help_heading = "Simulated motors")]
struct Simulation {
    /// The motors' time constant, from 10ms to 10s
    #[arg(long, value_name = "DURATION", default_value = "250ms", value_parser = |text: &str| duration_within(text, "10ms", "10s"))]
    response: Duration,

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
        jaus-primitive-driver --noise 0.1 --seed 7  with unequal motors\n  \
        jaus-primitive-driver --wheelbase 0.5       with steered front wheels";
    const ID: JausId = JausId::new(101, 33, 33);

    fn part(self) -> Result<impl Part, Failure> {
        self.can.check()?;
        self.gpio.check()?;
        Ok(PrimitiveDriver {
            motors: self.motors(),
            steering: self.steering(),
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
    fn steering(&self) -> Option<SteeringGear> {
        Some(SteeringGear {
            geometry: Ackermann {
                wheelbase: self.wheelbase?,
                max_angle: self.steering_angle.to_radians(),
            },
            servo: self.servo.settings(self.steering_angle),
        })
    }

    fn stop(&self) -> Option<Stop> {
        #[cfg(all(feature = "gpio", target_os = "linux"))]
        if let Some((chip, line)) = self.gpio.stop_line.clone() {
            return Some(Stop::Gpio { chip, line });
        }
        self.stop_file.clone().map(Stop::File)
    }

    fn motors(&self) -> Motors {
        #[cfg(all(feature = "can", target_os = "linux"))]
        if let Some(motors) = self.can.motors(self.deadline) {
            return Motors::Can(motors);
        }
        #[cfg(all(feature = "gpio", target_os = "linux"))]
        if let Some(motors) = self.gpio.motors(self.speed, self.deadline) {
            return Motors::Gpio(motors);
        }
        let motor = MotorConfig {
            top: self.speed,
            response: self.simulation.response.as_secs_f64(),
            noise: self.simulation.noise,
            seed: self.simulation.seed,
            deadline: self.deadline,
            ..MotorConfig::default()
        };
        // A real motor has its own noise.
        let real = MotorConfig {
            noise: 0.0,
            ..motor
        };
        if let Some(motors) = self.bridges.motors(real) {
            return Motors::HBridges(motors);
        }
        match &self.controller.sabertooth {
            Some(device) => Motors::Sabertooth(Sabertooth {
                device: device.clone(),
                baud: self.controller.sabertooth_baud,
                address: self.controller.sabertooth_address,
                motor: real,
            }),
            None => Motors::Simulated(motor),
        }
    }
}

impl Servo {
    /// The servo of a steering with this largest angle in degrees.
    fn settings(&self, max_angle: f64) -> parts::Servo {
        let rate = self.servo_rate.to_radians();
        match self.servo.clone() {
            None => parts::Servo::Simulated(rate),
            Some((chip, channel)) => parts::Servo::Pwm {
                chip,
                channel,
                config: ServoConfig {
                    centre: Duration::from_micros(self.servo_centre.into()),
                    swing: self.servo_swing,
                    max_angle: max_angle.to_radians(),
                    rate,
                },
            },
        }
    }
}

/// Parses a chip and a number: `/dev/gpiochip0:5`.
fn chip_and_number(text: &str) -> Result<(PathBuf, u32), String> {
    let pair = text.rsplit_once(':').filter(|(chip, _)| !chip.is_empty());
    pair.and_then(|(chip, line)| Some((PathBuf::from(chip), line.parse().ok()?)))
        .ok_or_else(|| {
            "write a path and a number such as /dev/gpiochip0:5 or /sys/class/pwm/pwmchip0:0"
                .to_owned()
        })
}

/// Parses two different numbers: `17,27`.
fn pair(text: &str) -> Result<(u32, u32), String> {
    let number = |text: &str| text.trim().parse::<u32>().ok();
    let pair = text.split_once(',');
    let pair = pair.and_then(|(first, second)| Some((number(first)?, number(second)?)));
    pair.filter(|(first, second)| first != second)
        .ok_or_else(|| "write two different numbers such as 17,27".to_owned())
}

/// The error about hardware that this build does not support.
#[cfg(not(all(feature = "can", feature = "gpio", target_os = "linux")))]
fn unsupported(flag: &str, feature: &str) -> Failure {
    Failure::new(format!(
        "{flag}: this program was built without the feature `{feature}`: build it on Linux with \
         `cargo build -p jaus-cli --features {feature}`, or use the Debian package"
    ))
}

mod can {
    #[cfg(all(feature = "can", target_os = "linux"))]
    use std::time::Duration;

    use clap::Args;
    use jaus_cli::Failure;
    use jaus_cli::runtime::between;
    #[cfg(all(feature = "can", target_os = "linux"))]
    use jaus_vehicle::parts::CanMotors;

    #[derive(Args)]
    #[command(next_help_heading = "VESC motor controllers on a CAN bus")]
    pub(super) struct Can {
        /// The network interface of the bus, such as can0 [default: simulated motors]
        #[arg(
            long,
            value_name = "INTERFACE",
            requires = "can_counts_per_metre",
            group = "motors"
        )]
        can: Option<String>,

        /// Id of the left motor's controller, from 0 to 254
        #[arg(long, value_name = "ID", default_value = "1", value_parser = clap::value_parser!(u8).range(0..=254))]
        can_left: u8,

        /// Id of the right motor's controller, from 0 to 254
        #[arg(long, value_name = "ID", default_value = "2", value_parser = clap::value_parser!(u8).range(0..=254))]
        can_right: u8,

        /// Counts of a controller's tachometer per metre of travel, from 1 to 1000000: 6 for each pole
        /// pair, times the reduction of the gear, by the circumference of the wheel in metres
        #[arg(long, value_name = "COUNTS", value_parser = |text: &str| between(text, 1.0, 1e6), requires = "can")]
        can_counts_per_metre: Option<f64>,
    }

    impl Can {
        /// Checks that this build supports what the flags ask for.
        pub(super) fn check(&self) -> Result<(), Failure> {
            #[cfg(not(all(feature = "can", target_os = "linux")))]
            if self.can.is_some() {
                return Err(super::unsupported("--can", "can"));
            }
            Ok(())
        }

        #[cfg(all(feature = "can", target_os = "linux"))]
        pub(super) fn motors(&self, deadline: Duration) -> Option<CanMotors> {
            Some(CanMotors {
                interface: self.can.clone()?,
                left: self.can_left,
                right: self.can_right,
                counts_per_metre: self.can_counts_per_metre?,
                deadline,
            })
        }
    }
}

mod gpio {
    use std::path::PathBuf;
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    use std::time::Duration;

    use clap::Args;
    use jaus_cli::Failure;
    use jaus_cli::runtime::between;
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    use jaus_vehicle::actuator::StepperConfig;
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    use jaus_vehicle::parts::GpioMotors;

    #[derive(Args)]
    #[command(next_help_heading = "Stepper motors on GPIO lines")]
    pub(super) struct Gpio {
        /// The GPIO chip of the motor drivers, such as /dev/gpiochip0 [default: simulated motors]
        #[arg(long, value_name = "CHIP", requires_all = ["left", "right"], group = "motors")]
        gpio: Option<PathBuf>,

        /// The left motor's lines: step, direction
        #[arg(long, value_name = "STEP,DIRECTION", value_parser = super::pair, requires = "gpio")]
        left: Option<(u32, u32)>,

        /// The right motor's lines; that motor is mounted mirrored
        #[arg(long, value_name = "STEP,DIRECTION", value_parser = super::pair, requires = "gpio")]
        right: Option<(u32, u32)>,

        /// A stop input: a normally closed contact between this line and ground, such as
        /// /dev/gpiochip0:5. An open contact or a broken wire stops the motors; closing it again
        /// clears all emergencies
        #[arg(long, value_name = "CHIP:LINE", value_parser = super::chip_and_number, conflicts_with = "stop_file")]
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
        /// Checks that this build supports what the flags ask for.
        pub(super) fn check(&self) -> Result<(), Failure> {
            #[cfg(not(all(feature = "gpio", target_os = "linux")))]
            for (flag, is_used) in [
                ("--gpio", self.gpio.is_some()),
                ("--stop-line", self.stop_line.is_some()),
            ] {
                if is_used {
                    return Err(super::unsupported(flag, "gpio"));
                }
            }
            Ok(())
        }

        #[cfg(all(feature = "gpio", target_os = "linux"))]
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
}

fn main() -> ExitCode {
    launch::<Flags>()
}
