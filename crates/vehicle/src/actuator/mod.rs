//! What turns the wheels: a small trait for a drive, a simulated one, one of stepper pulses, and the
//! platform that two of them make.
//!
//! A real drive implements [`Actuator`]; [`SimulatedMotor`] is a simulated one, and
//! [`Stepper`] counts out the pulses of a real one. [`Wheels`] makes a
//! [`Platform`](crate::motion::Platform) of a left and a right drive, and keeps an [`Odometer`] of
//! how far each has travelled.
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

#[cfg(all(feature = "gpio", target_os = "linux"))]
mod gpio;
mod motor;
mod pulses;
mod stepper;
mod stop;
mod wheels;

use std::time::Instant;

#[cfg(all(feature = "gpio", target_os = "linux"))]
pub use gpio::{GpioError, GpioLines, GpioStop};
pub use motor::{FaultSwitch, MotorConfig, SimulatedMotor};
pub use pulses::{Lines, PulseMotor};
pub use stepper::{Stepper, StepperConfig, StepperPoll};
pub use stop::{Interlock, SimulatedStop, StopFile, StopInput};
pub use wheels::{Odometer, Wheels, WheelsConfig};

/// One drive: a wheel, or the wheels of one side, with the motor that turns them and counts how far.
///
/// A drive MUST have its own deadline: without a [`command`](Self::command) for 200 ms
/// ([`CommandDeadline::DEFAULT`](crate::motion::CommandDeadline::DEFAULT), a setting of ours) it
/// brakes to [`Command::STOP`] by itself. Commands are repeated every 20 ms while it moves, so that
/// silence means that the program which drives it hangs. The deadline must not depend on that
/// program: keep it in the motor controller, or on a thread that only writes to the motor, as
/// `PulseMotor` does.
pub trait Actuator: Send {
    /// It is `now`: moves on, or reads back what has been done.
    fn handle_time(&mut self, now: Instant);

    /// What it is to do until the next command, and for at most the deadline.
    fn command(&mut self, command: Command);

    /// Metres that it has travelled since it was made, backwards negative.
    fn travel(&self) -> f64;

    /// Why it cannot do what it is commanded, as text for the operator; `None` while it can. It
    /// reports a fault until it is gone.
    fn fault(&self) -> Option<String> {
        None
    }
}

/// What a drive is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Propulsion as a share of what there is: -1 is full speed backwards in the end, 1 forwards.
    pub drive: f64,
    /// Braking as a share of what there is, 0 to 1.
    pub brake: f64,
}

impl Command {
    /// To stand still, as soon as the brakes allow.
    pub const STOP: Self = Self {
        drive: 0.0,
        brake: 1.0,
    };

    /// The command, or [`STOP`](Self::STOP) in place of one that is not finite.
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
