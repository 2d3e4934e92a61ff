//! Lines on a GPIO chip of Linux: those of a stepper motor's driver, and that of a stop input.

use std::io;
use std::path::{Path, PathBuf};

use gpiocdev::Request;
use gpiocdev::line::{Bias, Offset, Value};

use super::{Lines, StopInput};

/// Two lines of a chip: pulses and direction.
#[derive(Debug)]
pub struct GpioLines {
    request: Request,
    step: Offset,
    direction: Offset,
    /// Whether the motor is mounted the other way round.
    reversed: bool,
}

/// Why lines cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error(
    "{lines} of {} cannot be opened: {why}; `gpioinfo` lists the lines and who uses them, and the user \
     must be allowed to write to the chip",
    chip.display()
)]
pub struct GpioError {
    /// The chip.
    chip: PathBuf,
    /// The lines, such as `line 5`.
    lines: String,
    /// What the kernel says.
    why: gpiocdev::Error,
}

impl GpioLines {
    /// Takes two lines of a chip such as `/dev/gpiochip0` as outputs, both low.
    ///
    /// # Errors
    /// If there is no such chip or line, or somebody else uses it.
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

/// A stop input on a line of a chip, with the chip's pull-up: the contact connects the line to
/// ground while it is closed, so that a cut wire reads as open.
#[derive(Debug)]
pub struct GpioStop {
    request: Request,
    line: Offset,
}

impl GpioStop {
    /// Takes a line of a chip such as `/dev/gpiochip0` as an input.
    ///
    /// # Errors
    /// If there is no such chip or line, or it is in use.
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
