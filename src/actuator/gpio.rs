//! The lines of a stepper motor's driver on a GPIO chip of Linux.

use std::io;
use std::path::{Path, PathBuf};

use gpiocdev::Request;
use gpiocdev::line::{Offset, Value};

use super::Lines;

/// Two lines of a chip: pulses and direction.
#[derive(Debug)]
pub struct GpioLines {
    request: Request,
    step: Offset,
    direction: Offset,
    /// Whether the motor is mounted the other way round.
    reversed: bool,
}

/// Why lines can not be had.
#[derive(Debug, thiserror::Error)]
#[error(
    "lines {step} and {direction} of {} can not be had: {why}; see `gpioinfo` for what there is and who \
     uses it, and mind that the user may write to the chip",
    chip.display()
)]
pub struct GpioError {
    /// The chip.
    chip: PathBuf,
    /// The line of the pulses.
    step: Offset,
    /// The line of the direction.
    direction: Offset,
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
                step,
                direction,
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
