//! The hardware of the primitive driver: motors, steering and stop input, as settings and opened.

use std::time::Duration;

use super::PartError;
use crate::actuator::{
    Actuator, HBridge, Interlock, MotorConfig, Odometer, OpenLoopMotor, PwmError, PwmOutput,
    PwmServo, ServoConfig, SimulatedMotor, SimulatedServo, Steering, StopFile, StopInput, Wheels,
    WheelsConfig,
};
use crate::motion::{Ackermann, Frame, Pilot};

/// The motors of both sides.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Motors {
    /// Simulated motors. The right one uses the seed after the left one's.
    Simulated(MotorConfig),
    /// The two motors of a Sabertooth motor controller on a serial line.
    #[cfg(feature = "serial")]
    Sabertooth(Sabertooth),
    /// Motors on H-bridges at the outputs of a PWM chip.
    HBridges(HBridgeMotors),
    /// VESC motor controllers on a CAN bus.
    #[cfg(all(feature = "can", target_os = "linux"))]
    Can(CanMotors),
    /// Stepper motors on lines of a GPIO chip.
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    Gpio(GpioMotors),
}

/// Steered front wheels.
#[derive(Debug, Clone, PartialEq)]
pub struct SteeringGear {
    /// Wheelbase and largest steering angle.
    pub geometry: Ackermann,
    /// What turns the wheels.
    pub servo: Servo,
}

/// A steering servo.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Servo {
    /// A simulated servo with this rate in radians per second.
    Simulated(f64),
    /// A servo on a PWM output.
    Pwm {
        /// The chip, such as `/sys/class/pwm/pwmchip0`.
        chip: std::path::PathBuf,
        /// The output of the chip.
        channel: u32,
        /// Pulse lengths and rate.
        config: ServoConfig,
    },
}

/// A motor controller on a serial line.
#[cfg(feature = "serial")]
#[derive(Debug, Clone, PartialEq)]
pub struct Sabertooth {
    /// The serial line, such as `/dev/ttyUSB0`.
    pub device: String,
    /// Bits per second of the line.
    pub baud: u32,
    /// The controller's address, 128 to 135.
    pub address: u8,
    /// Top speed and lag of the motors, from which the travel is estimated, and their deadline.
    pub motor: MotorConfig,
}

#[cfg(feature = "serial")]
impl Sabertooth {
    /// A line that takes no data for this time is a fault.
    const WRITE_TIMEOUT: Duration = Duration::from_millis(100);

    fn start(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        let started = serial2::SerialPort::open(&self.device, self.baud).and_then(|mut line| {
            line.set_write_timeout(Self::WRITE_TIMEOUT)?;
            OpenLoopMotor::sabertooth(line, self.address, self.motor)
        });
        let motors = started.map_err(|error| {
            PartError::Broken(format!(
                "cannot use the motor controller on {}: {error}; check the device and the group of \
                 its file, usually dialout",
                self.device
            ))
        })?;
        Ok(motors.map(|motor| Box::new(motor) as _))
    }
}

/// Motors on H-bridges at the outputs of a PWM chip.
#[derive(Debug, Clone, PartialEq)]
pub struct HBridgeMotors {
    /// The chip, such as `/sys/class/pwm/pwmchip0`.
    pub chip: std::path::PathBuf,
    /// The left motor's outputs: ahead and back.
    pub left: (u32, u32),
    /// The right motor's outputs: ahead and back.
    pub right: (u32, u32),
    /// Interval between two pulses.
    pub period: Duration,
    /// Top speed and lag of the motors, from which the travel is estimated, and their deadline.
    pub motor: MotorConfig,
}

impl HBridgeMotors {
    fn start<const N: usize>(
        &self,
        outputs: [(u32, u32); N],
    ) -> Result<[Box<dyn Actuator>; N], PartError> {
        let open = |channel| PwmOutput::open(&self.chip, channel, self.period).map_err(broken);
        let mut bridges = Vec::new();
        for (ahead, back) in outputs {
            bridges.push(HBridge {
                ahead: open(ahead)?,
                back: open(back)?,
            });
        }
        tracing::warn!(
            "the PWM outputs keep their duty cycle if this program is killed: see that something \
             else switches them off then, such as its systemd unit"
        );
        let motors = OpenLoopMotor::h_bridges(bridges, self.motor);
        let motors = motors.map_err(|error| {
            PartError::Broken(format!("cannot start the thread of the motors: {error}"))
        })?;
        Ok(motors.map(|motor| Box::new(motor) as _))
    }
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn broken(error: PwmError) -> PartError {
    PartError::Broken(error.to_string())
}

/// VESC motor controllers on a CAN bus.
#[cfg(all(feature = "can", target_os = "linux"))]
#[derive(Debug, Clone, PartialEq)]
pub struct CanMotors {
    /// The network interface of the bus, such as `can0`.
    pub interface: String,
    /// Id of the left motor's controller, 0 to 254.
    pub left: u8,
    /// Id of the right motor's controller.
    pub right: u8,
    /// Counts of a controller's tachometer per metre of travel.
    pub counts_per_metre: f64,
    /// The motors stop without a command for this time.
    pub deadline: Duration,
}

#[cfg(all(feature = "can", target_os = "linux"))]
impl CanMotors {
    fn start<const N: usize>(&self, ids: [u8; N]) -> Result<[Box<dyn Actuator>; N], PartError> {
        let interface = &self.interface;
        let started = crate::actuator::SocketCan::open(interface).and_then(|bus| {
            crate::actuator::VescMotor::start(bus, ids, self.counts_per_metre, self.deadline)
        });
        let motors = started.map_err(|error| {
            PartError::Broken(format!(
                "cannot use the CAN bus {interface}: {error}; bring it up with `ip link set \
                 {interface} up type can bitrate 500000`"
            ))
        })?;
        Ok(motors.map(|motor| Box::new(motor) as _))
    }
}

impl SteeringGear {
    /// Simulated steering.
    #[must_use]
    pub const fn simulated(geometry: Ackermann) -> Self {
        Self {
            geometry,
            servo: Servo::Simulated(SimulatedServo::RATE),
        }
    }
}

impl Servo {
    fn start(&self) -> Result<Box<dyn Steering>, PartError> {
        match self {
            Self::Simulated(rate) => Ok(Box::new(SimulatedServo::new(*rate))),
            Self::Pwm {
                chip,
                channel,
                config,
            } => {
                let output = PwmOutput::open(chip, *channel, PwmServo::PERIOD).map_err(broken)?;
                Ok(Box::new(PwmServo::new(output, *config)))
            }
        }
    }
}

/// The stop input on the vehicle.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Stop {
    /// A simulated input, pressed while a file exists.
    File(std::path::PathBuf),
    /// A normally closed contact between a line of a GPIO chip and ground.
    #[cfg(all(feature = "gpio", target_os = "linux"))]
    Gpio {
        /// The chip, such as `/dev/gpiochip0`.
        chip: std::path::PathBuf,
        /// The line.
        line: u32,
    },
}

impl Stop {
    pub(super) fn open(&self) -> Result<Box<dyn StopInput>, PartError> {
        match self {
            Self::File(path) => Ok(Box::new(StopFile(path.clone()))),
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio { chip, line } => match crate::actuator::GpioStop::open(chip, *line) {
                Ok(input) => Ok(Box::new(input)),
                Err(error) => Err(PartError::Broken(error.to_string())),
            },
        }
    }
}

/// The hardware of a primitive driver.
pub struct Hardware {
    /// The drives, and the steering if the vehicle has one.
    pub drives: Drives,
    /// The stop input, if there is one.
    pub stop: Option<Box<dyn StopInput>>,
}

/// The drives of a vehicle.
pub enum Drives {
    /// A drive on each side.
    Sides {
        /// The drive of the left side.
        left: Box<dyn Actuator>,
        /// The drive of the right side.
        right: Box<dyn Actuator>,
    },
    /// One drive and steered front wheels.
    Steered {
        /// The drive of the rear axle.
        drive: Box<dyn Actuator>,
        /// The steering of the front axle.
        steering: Box<dyn Steering>,
        /// Wheelbase and largest steering angle.
        geometry: Ackermann,
    },
}

impl Drives {
    /// Starts motors, and steering if there is one.
    pub(super) fn start(
        motors: &Motors,
        steering: Option<&SteeringGear>,
    ) -> Result<Self, PartError> {
        match steering {
            None => motors
                .start_both()
                .map(|[left, right]| Self::Sides { left, right }),
            Some(SteeringGear { geometry, servo }) => Ok(Self::Steered {
                drive: motors.start_left()?,
                steering: servo.start()?,
                geometry: *geometry,
            }),
        }
    }

    /// A pilot for these drives.
    pub(super) fn pilot(
        self,
        config: WheelsConfig,
        odometer: Odometer,
        interlock: Interlock,
    ) -> Pilot {
        let frame = Frame::default();
        match self {
            Self::Sides { left, right } => {
                let wheels = Wheels::new(left, right, config, odometer);
                Pilot::new(wheels.with_interlock(interlock), frame)
            }
            Self::Steered {
                drive,
                steering,
                geometry,
            } => {
                let wheels = Wheels::steered(drive, steering, config, geometry, odometer);
                Pilot::new(wheels.with_interlock(interlock), frame)
            }
        }
    }
}

impl std::fmt::Debug for Hardware {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Hardware")
            .field("has_stop", &self.stop.is_some())
            .finish_non_exhaustive()
    }
}

/// Two stepper motors on a GPIO chip.
#[cfg(all(feature = "gpio", target_os = "linux"))]
#[derive(Debug, Clone, PartialEq)]
pub struct GpioMotors {
    /// The chip, such as `/dev/gpiochip0`.
    pub chip: std::path::PathBuf,
    /// Parameters of both motors and their wheels.
    pub stepper: crate::actuator::StepperConfig,
    /// The lines of the left motor: pulses and direction.
    pub left: (u32, u32),
    /// The lines of the right motor, which is mounted in reverse.
    pub right: (u32, u32),
}

impl Motors {
    /// Starts the motors of both sides.
    fn start_both(&self) -> Result<[Box<dyn Actuator>; 2], PartError> {
        match self {
            Self::Simulated(config) => Ok([simulated(*config, 0), simulated(*config, 1)]),
            #[cfg(feature = "serial")]
            Self::Sabertooth(controller) => controller.start(),
            Self::HBridges(motors) => motors.start([motors.left, motors.right]),
            #[cfg(all(feature = "can", target_os = "linux"))]
            Self::Can(motors) => motors.start([motors.left, motors.right]),
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio(motors) => Ok([motors.start_left()?, motors.start_right()?]),
        }
    }

    /// Starts the left motor alone.
    fn start_left(&self) -> Result<Box<dyn Actuator>, PartError> {
        match self {
            Self::Simulated(config) => Ok(simulated(*config, 0)),
            #[cfg(feature = "serial")]
            Self::Sabertooth(controller) => controller.start().map(|[left, _]| left),
            Self::HBridges(motors) => motors.start([motors.left]).map(|[left]| left),
            #[cfg(all(feature = "can", target_os = "linux"))]
            Self::Can(motors) => motors.start([motors.left]).map(|[left]| left),
            #[cfg(all(feature = "gpio", target_os = "linux"))]
            Self::Gpio(motors) => motors.start_left(),
        }
    }
}

/// A simulated motor with its own noise.
fn simulated(config: MotorConfig, number: u64) -> Box<dyn Actuator> {
    let seed = config.seed.wrapping_add(number);
    Box::new(SimulatedMotor::new(MotorConfig { seed, ..config }))
}

#[cfg(all(feature = "gpio", target_os = "linux"))]
impl GpioMotors {
    fn start_left(&self) -> Result<Box<dyn Actuator>, PartError> {
        self.start(self.left, false)
    }

    fn start_right(&self) -> Result<Box<dyn Actuator>, PartError> {
        self.start(self.right, true)
    }

    fn start(
        &self,
        (step, direction): (u32, u32),
        reversed: bool,
    ) -> Result<Box<dyn Actuator>, PartError> {
        let broken = |why: String| PartError::Broken(why);
        let lines = crate::actuator::GpioLines::open(&self.chip, step, direction, reversed);
        let lines = lines.map_err(|error| broken(error.to_string()))?;
        let motor = crate::actuator::PulseMotor::start(self.stepper, lines);
        let motor =
            motor.map_err(|error| broken(format!("cannot start the pulse thread: {error}")))?;
        Ok(Box::new(motor))
    }
}
