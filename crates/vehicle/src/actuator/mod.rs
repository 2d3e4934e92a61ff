//! Wheel drives and steering: the traits [`Actuator`] and [`Steering`], simulated and real ones, and
//! platforms of them.
//!
//! A driver for real hardware implements [`Actuator`] or [`Steering`]. [`SimulatedMotor`] and
//! [`SimulatedServo`] simulate them; [`PulseMotor`] drives a stepper motor, [`OpenLoopMotor`] one
//! behind a serial controller or an H-bridge, [`VescMotor`] one behind a controller on a CAN bus,
//! [`PwmServo`] a steering servo.
//! [`Wheels`] is the [`Platform`](crate::motion::Platform): [a left and a right drive](SideDrives),
//! or [one drive and steered front wheels](SteeredDrive). An [`Odometer`] reports the distance that
//! the wheels of each side have travelled.
//!
//! ```
//! use jaus_vehicle::actuator::{MotorConfig, Odometer, SimulatedMotor, Wheels, WheelsConfig};
//! use jaus_vehicle::motion::{Frame, Pilot};
//!
//! let motor = |seed| SimulatedMotor::new(MotorConfig { seed, ..MotorConfig::default() });
//! let odometer = Odometer::new(7);
//! let wheels = Wheels::new(motor(1), motor(2), WheelsConfig::default(), odometer.clone());
//! let pilot = Pilot::new(wheels, Frame::default());
//! assert!(pilot.is_at_rest());
//! assert_eq!(odometer.count().left, 0.0);
//! ```

mod can;
#[cfg(all(feature = "gpio", target_os = "linux"))]
mod gpio;
mod h_bridge;
mod motion_monitor;
mod motor;
mod motor_thread;
mod pulses;
mod pwm_output;
mod pwm_servo;
mod sabertooth;
mod side_drives;
#[cfg(all(feature = "can", target_os = "linux"))]
mod socket_can;
mod steered_drive;
mod steering;
mod stepper;
mod stop;
mod vesc;
mod wheels;

use std::time::Instant;

pub use can::{CanBus, CanFrame, VirtualBus};
#[cfg(all(feature = "gpio", target_os = "linux"))]
pub use gpio::{GpioError, GpioLines, GpioStop};
pub use h_bridge::HBridge;
pub use motor::{FaultSwitch, MotorConfig, SimulatedMotor};
pub use motor_thread::OpenLoopMotor;
pub use pulses::{Lines, PulseMotor};
pub use pwm_output::{PwmError, PwmOutput};
pub use pwm_servo::{PwmServo, ServoConfig};
pub use side_drives::SideDrives;
#[cfg(all(feature = "can", target_os = "linux"))]
pub use socket_can::SocketCan;
pub use steered_drive::SteeredDrive;
pub use steering::{SimulatedServo, Steering};
pub use stepper::{Stepper, StepperConfig, StepperPoll};
pub use stop::{Interlock, SimulatedStop, StopFile, StopInput};
pub use vesc::VescMotor;
pub use wheels::{Drivetrain, Odometer, Wheels, WheelsConfig};

/// One drive: a wheel, or the wheels of one side, with motor and distance counter.
///
/// A drive MUST have its own deadline: without a [`command`](Self::command) for 200 ms
/// ([`CommandDeadline::DEFAULT`](crate::motion::CommandDeadline::DEFAULT), chosen by this project)
/// it brakes to [`Command::STOP`] on its own. Commands are repeated every 20 ms while the vehicle
/// moves, so silence means that the controlling program hangs. The deadline must not depend on that
/// program: implement it in the motor controller, or on a thread that only writes to the motor, as
/// `PulseMotor` does.
pub trait Actuator: Send {
    /// Advances to time `now`: a simulation integrates, real hardware is read back.
    fn handle_time(&mut self, now: Instant);

    /// Sets the command, which holds until the next one or until the deadline.
    fn command(&mut self, command: Command);

    /// Distance travelled since creation, in metres. Reverse travel is negative.
    fn travel(&self) -> f64;

    /// The fault that prevents the drive from executing commands, as text for the operator; `None`
    /// without a fault. A fault is reported until it is cleared.
    fn fault(&self) -> Option<String> {
        None
    }
}

/// A command to a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Propulsion as a fraction of the maximum. A sustained -1 reaches full reverse speed, 1 full
    /// forward speed.
    pub drive: f64,
    /// Braking as a fraction of the maximum, 0 to 1.
    pub brake: f64,
}

impl Command {
    /// Stop as fast as the brakes allow.
    pub const STOP: Self = Self {
        drive: 0.0,
        brake: 1.0,
    };

    /// Returns the command, or [`STOP`](Self::STOP) if it is not finite.
    #[must_use]
    pub const fn or_stop(self) -> Self {
        if self.drive.is_finite() && self.brake.is_finite() {
            self
        } else {
            Self::STOP
        }
    }
}

impl Default for Command {
    fn default() -> Self {
        Self::STOP
    }
}

impl<A: Actuator + ?Sized> Actuator for Box<A> {
    fn handle_time(&mut self, now: Instant) {
        (**self).handle_time(now);
    }

    fn command(&mut self, command: Command) {
        (**self).command(command);
    }

    fn travel(&self) -> f64 {
        (**self).travel()
    }

    fn fault(&self) -> Option<String> {
        (**self).fault()
    }
}
