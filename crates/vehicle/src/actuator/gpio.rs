//! Linux GPIO lines: pulse and direction outputs for a stepper driver, and a stop input.

use std::io;
use std::path::{Path, PathBuf};

use gpiocdev::Request;
use gpiocdev::line::{Bias, Offset, Value};

use super::{Lines, StopInput};

/// Pulse and direction lines on one chip.
#[derive(Debug)]
pub struct GpioLines {
    request: Request,
    step: Offset,
    direction: Offset,
    /// Whether the motor is mounted in reverse.
    reversed: bool,
}

/// Error: GPIO lines cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot open {lines} of {}: {why}; check their users with `gpioinfo`, and write access to the \
     chip",
    chip.display()
)]
pub struct GpioError {
    /// The chip.
    chip: PathBuf,
    /// The lines, such as `line 5`.
    lines: String,
    /// The kernel's error.
    why: gpiocdev::Error,
}

impl GpioLines {
    /// Requests two lines of a chip such as `/dev/gpiochip0` as outputs, initially low.
    ///
    /// # Errors
    /// If the chip or a line does not exist, or is in use.
    pub fn open(
        chip: &Path,
        step: Offset,
        direction: Offset,
        reversed: bool,
    ) -> Result<Self, GpioError> {
        let request = Request::builder()
            .on_chip(chip)
            .with_consumer("jaus")
            .with_lines(&[step, direction])
            .as_output(Value::Inactive)
            .request();
        match request {
            Ok(request) => Ok(Self {
                request,
                step,
                direction,
                reversed,
            }),
            Err(why) => Err(GpioError {
                chip: chip.to_owned(),
                lines: format!("lines {step} and {direction}"),
                why,
            }),
        }
    }

    fn set(&self, line: Offset, high: bool) -> io::Result<()> {
        let set = self.request.set_value(line, Value::from(high));
        set.map(drop).map_err(io::Error::other)
    }
}

impl Lines for GpioLines {
    fn set_direction(&mut self, backwards: bool) -> io::Result<()> {
        self.set(self.direction, backwards != self.reversed)
    }

    fn set_step(&mut self, high: bool) -> io::Result<()> {
        self.set(self.step, high)
    }
}

/// A stop input on a GPIO line with the chip's pull-up. The closed contact connects the line to
/// ground, so a cut wire reads as open.
#[derive(Debug)]
pub struct GpioStop {
    request: Request,
    line: Offset,
}

impl GpioStop {
    /// Requests a line of a chip such as `/dev/gpiochip0` as an input.
    ///
    /// # Errors
    /// If the chip or the line does not exist, or is in use.
    pub fn open(chip: &Path, line: Offset) -> Result<Self, GpioError> {
        let request = Request::builder()
            .on_chip(chip)
            .with_consumer("jaus stop")
            .with_line(line)
            .as_input()
            .as_active_low()
            .with_bias(Bias::PullUp)
            .request();
        match request {
            Ok(request) => Ok(Self { request, line }),
            Err(why) => Err(GpioError {
                chip: chip.to_owned(),
                lines: format!("line {line}"),
                why,
            }),
        }
    }
}

impl StopInput for GpioStop {
    fn is_closed(&mut self) -> io::Result<bool> {
        let value = self.request.value(self.line).map_err(io::Error::other)?;
        Ok(value == Value::Active)
    }
}
