//! PWM outputs of Linux (`/sys/class/pwm`).
//!
//! An output keeps its last pulse length when the program is killed. A servo then holds its angle; a
//! motor turns on.
#![expect(
    clippy::disallowed_methods,
    reason = "waits for the kernel to provide the output"
)]

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// An output of a PWM chip. Dropping it ends the pulses.
#[derive(Debug)]
pub struct PwmOutput {
    /// Directory of the output.
    directory: PathBuf,
    /// Interval between two pulses in nanoseconds.
    period: u64,
    /// The pulse length in force, in nanoseconds.
    pulse: Option<u64>,
}

/// Error: a PWM output cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot use PWM output {channel} of {}: {why}; check the chip and the group of its files",
    chip.display()
)]
pub struct PwmError {
    chip: PathBuf,
    channel: u32,
    why: io::Error,
}

impl PwmOutput {
    /// The kernel and udev provide the files of an output within this time.
    const PATIENCE: Duration = Duration::from_secs(2);

    /// Opens an output of a chip such as `/sys/class/pwm/pwmchip0`, with this interval between
    /// pulses, and starts with pulses of length 0.
    ///
    /// # Errors
    /// If the chip or the output does not exist, may not be used, or cannot have this interval.
    pub fn open(chip: &Path, channel: u32, period: Duration) -> Result<Self, PwmError> {
        let failed = |why| PwmError {
            chip: chip.to_owned(),
            channel,
            why,
        };
        let directory = chip.join(format!("pwm{channel}"));
        export(chip, channel, &directory).map_err(failed)?;
        let output = Self {
            directory,
            period: u64::try_from(period.as_nanos()).unwrap_or(u64::MAX),
            pulse: None,
        };
        begin(output.period, |file, value| output.write(file, value)).map_err(failed)?;
        Ok(output)
    }

    /// Sets the pulse length in nanoseconds, at most the interval between pulses.
    ///
    /// # Errors
    /// If the output cannot be written. The next call tries again.
    pub(super) fn set_pulse(&mut self, pulse: u64) -> io::Result<()> {
        let pulse = pulse.min(self.period);
        if self.pulse != Some(pulse) {
            self.pulse = None;
            self.write("duty_cycle", pulse)?;
            self.pulse = Some(pulse);
        }
        Ok(())
    }

    /// Sets the share of the time that the output is on, 0 to 1.
    ///
    /// # Errors
    /// If the output cannot be written. The next call tries again.
    pub(super) fn set_share(&mut self, share: f64) -> io::Result<()> {
        let pulse = share.clamp(0.0, 1.0) * self.period as f64;
        self.set_pulse(pulse.round() as u64)
    }

    fn write(&self, file: &str, value: u64) -> io::Result<()> {
        fs::write(self.directory.join(file), value.to_string())
    }
}

/// Starts pulses of length 0 by writing the files of an output.
fn begin(period: u64, mut write: impl FnMut(&str, u64) -> io::Result<()>) -> io::Result<()> {
    // The kernel refuses everything but a period while the period is 0, as it is after the export,
    // and a period shorter than the pulse length, which a killed program leaves behind.
    if write("period", period).is_err() {
        write("duty_cycle", 0)?;
        write("period", period)?;
    }
    write("duty_cycle", 0)?;
    write("enable", 1)
}

/// Has the kernel provide the files of an output, and waits until they may be written.
fn export(chip: &Path, channel: u32, directory: &Path) -> io::Result<()> {
    if !directory.is_dir() {
        fs::write(chip.join("export"), channel.to_string())?;
    }
    let end = Instant::now() + PwmOutput::PATIENCE;
    loop {
        let enable = fs::OpenOptions::new()
            .write(true)
            .open(directory.join("enable"));
        match enable {
            Ok(_) => return Ok(()),
            Err(error) if Instant::now() >= end => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

impl Drop for PwmOutput {
    fn drop(&mut self) {
        if let Err(error) = self.write("enable", 0) {
            let output = self.directory.display();
            tracing::warn!("cannot switch {output} off: {error}");
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A directory that looks like a PWM chip with some outputs.
    pub(crate) struct Chip(pub(crate) PathBuf);

    impl Chip {
        pub(crate) fn new(name: &str, outputs: &[u32]) -> Self {
            let name = format!("jaus-pwm-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            fs::create_dir_all(&path).unwrap();
            fs::write(path.join("export"), "").unwrap();
            for output in outputs {
                let directory = path.join(format!("pwm{output}"));
                fs::create_dir_all(&directory).unwrap();
                for file in ["enable", "period", "duty_cycle"] {
                    fs::write(directory.join(file), "0").unwrap();
                }
            }
            Self(path)
        }

        pub(crate) fn read(&self, output: u32, file: &str) -> u64 {
            let path = self.0.join(format!("pwm{output}")).join(file);
            fs::read_to_string(path).unwrap().parse().unwrap()
        }
    }

    impl Drop for Chip {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_chip_that_does_not_exist_is_named() {
        let error = PwmOutput::open(Path::new("/nowhere"), 0, Duration::from_millis(20));
        let error = error.unwrap_err().to_string();
        assert!(error.contains("PWM output 0 of /nowhere"), "{error}");
    }

    /// An output as the kernel keeps it (`pwm_apply_state`).
    #[derive(Debug, Clone, Copy, PartialEq, Default)]
    struct Output {
        period: u64,
        pulse: u64,
        is_enabled: bool,
    }

    impl Output {
        fn write(&mut self, file: &str, value: u64) -> io::Result<()> {
            let mut next = *self;
            match file {
                "period" => next.period = value,
                "duty_cycle" => next.pulse = value,
                "enable" => next.is_enabled = value == 1,
                _ => return Err(io::ErrorKind::NotFound.into()),
            }
            if next.period == 0 || next.pulse > next.period {
                return Err(io::ErrorKind::InvalidInput.into());
            }
            *self = next;
            Ok(())
        }
    }

    #[test]
    fn an_output_starts_with_pulses_of_length_0_whatever_it_did_before() {
        let exported = Output::default();
        let killed = |period, pulse| Output {
            period,
            pulse,
            is_enabled: true,
        };
        for before in [
            exported,
            killed(20_000, 19_000),
            killed(50_000, 50_000),
            killed(20_000_000, 1_500_000),
        ] {
            let mut output = before;
            begin(50_000, |file, value| output.write(file, value)).unwrap();
            assert_eq!(output, killed(50_000, 0), "{before:?}");
        }
    }

    #[test]
    fn pulses_are_never_longer_than_their_interval() {
        let chip = Chip::new("share", &[0]);
        let mut output = PwmOutput::open(&chip.0, 0, Duration::from_micros(50)).unwrap();
        for (share, pulse) in [(0.5, 25_000), (2.0, 50_000), (f64::NAN, 0)] {
            output.set_share(share).unwrap();
            assert_eq!(chip.read(0, "duty_cycle"), pulse);
        }
    }
}
