//! A steering servo on a PWM output of Linux (`/sys/class/pwm`): the pulse length sets the angle.
//!
//! An output keeps its last pulse length when the program dies. For a servo that is harmless, because
//! it only holds its angle. A motor would go on turning, so there is no driver for motors on such
//! an output.
#![expect(
    clippy::disallowed_methods,
    reason = "waits for the kernel to provide the output"
)]

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{SimulatedServo, Steering};

/// Parameters of a steering servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoConfig {
    /// Pulse length straight ahead.
    pub centre: Duration,
    /// Change of the pulse length at the largest angle to the right, in microseconds. Negative for a
    /// servo that is mounted the other way.
    pub swing: i32,
    /// Largest steering angle to either side in radians.
    pub max_angle: f64,
    /// How fast the servo turns, in radians per second.
    pub rate: f64,
}

/// A steering servo on a PWM output. Dropping it ends the pulses, so the servo goes limp.
///
/// The servo does not report its angle. It is estimated from the commands and the rate.
#[derive(Debug)]
pub struct PwmServo {
    /// Directory of the output.
    output: PathBuf,
    config: ServoConfig,
    /// Estimates the angle.
    model: SimulatedServo,
    /// The angle to turn to, in radians.
    setpoint: f64,
    /// The pulse length in force, in nanoseconds.
    pulse: Option<u64>,
    fault: Option<String>,
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

impl PwmServo {
    /// Interval between two pulses, in nanoseconds: 20 ms, as servos expect.
    const PERIOD: u64 = 20_000_000;
    /// The kernel and udev provide the files of an output within this time.
    const PATIENCE: Duration = Duration::from_secs(2);

    /// Opens an output of a chip such as `/sys/class/pwm/pwmchip0`, and steers straight ahead.
    ///
    /// # Errors
    /// If the chip or the output does not exist, or may not be used.
    pub fn open(chip: &Path, channel: u32, config: ServoConfig) -> Result<Self, PwmError> {
        let failed = |why| PwmError {
            chip: chip.to_owned(),
            channel,
            why,
        };
        let output = chip.join(format!("pwm{channel}"));
        export(chip, channel, &output).map_err(failed)?;
        let mut servo = Self {
            output,
            config,
            model: SimulatedServo::new(config.rate),
            setpoint: 0.0,
            pulse: None,
            fault: None,
        };
        servo.begin().map_err(failed)?;
        Ok(servo)
    }

    fn begin(&mut self) -> io::Result<()> {
        // A period shorter than the pulse length is an error, so that length is 0 meanwhile.
        self.write("duty_cycle", 0)?;
        self.write("period", Self::PERIOD)?;
        self.set_pulse()?;
        self.write("enable", 1)
    }

    /// Sets the pulse length for the angle to turn to, if it is another one.
    fn set_pulse(&mut self) -> io::Result<()> {
        let share = (self.setpoint / self.config.max_angle).clamp(-1.0, 1.0);
        let swing = share * f64::from(self.config.swing) * 1000.0;
        let pulse = (self.config.centre.as_nanos() as f64 + swing).max(0.0) as u64;
        let pulse = pulse.min(Self::PERIOD);
        if self.pulse != Some(pulse) {
            self.write("duty_cycle", pulse)?;
            self.pulse = Some(pulse);
        }
        Ok(())
    }

    fn write(&self, file: &str, value: u64) -> io::Result<()> {
        fs::write(self.output.join(file), value.to_string())
    }
}

/// Has the kernel provide the files of an output, and waits until they may be written.
fn export(chip: &Path, channel: u32, output: &Path) -> io::Result<()> {
    if !output.is_dir() {
        fs::write(chip.join("export"), channel.to_string())?;
    }
    let end = Instant::now() + PwmServo::PATIENCE;
    loop {
        let enable = fs::OpenOptions::new()
            .write(true)
            .open(output.join("enable"));
        match enable {
            Ok(_) => return Ok(()),
            Err(error) if Instant::now() >= end => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

impl Steering for PwmServo {
    /// While the output cannot be written, each call tries again.
    fn handle_time(&mut self, now: Instant) {
        if self.fault.is_some() {
            self.steer(self.setpoint);
        }
        self.model.handle_time(now);
    }

    fn steer(&mut self, angle: f64) {
        if !angle.is_finite() {
            return;
        }
        self.setpoint = angle;
        match self.set_pulse() {
            Ok(()) => {
                self.fault = None;
                self.model.steer(angle);
            }
            Err(error) => {
                self.pulse = None;
                self.fault = Some(format!("cannot set the steering servo: {error}"));
            }
        }
    }

    fn angle(&self) -> f64 {
        self.model.angle()
    }

    fn fault(&self) -> Option<String> {
        self.fault.clone()
    }
}

impl Drop for PwmServo {
    fn drop(&mut self) {
        if let Err(error) = self.write("enable", 0) {
            tracing::warn!("cannot switch the steering servo off: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A directory that looks like a PWM chip with one output.
    struct Chip(PathBuf);

    impl Chip {
        fn new(name: &str) -> Self {
            let name = format!("jaus-pwm-{name}-{}", std::process::id());
            let path = std::env::temp_dir().join(name);
            fs::create_dir_all(path.join("pwm3")).unwrap();
            for file in ["export", "pwm3/enable", "pwm3/period", "pwm3/duty_cycle"] {
                fs::write(path.join(file), "0").unwrap();
            }
            Self(path)
        }

        fn read(&self, file: &str) -> u64 {
            let text = fs::read_to_string(self.0.join("pwm3").join(file));
            text.unwrap().parse().unwrap()
        }
    }

    impl Drop for Chip {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    const CONFIG: ServoConfig = ServoConfig {
        centre: Duration::from_micros(1500),
        swing: 400,
        max_angle: 0.5,
        rate: 2.0,
    };

    #[test]
    fn the_pulse_follows_the_angle_and_ends_with_the_servo() {
        let chip = Chip::new("angle");
        let mut servo = PwmServo::open(&chip.0, 3, CONFIG).unwrap();
        assert_eq!(chip.read("period"), 20_000_000);
        for (angle, pulse) in [(0.0, 1_500_000), (0.5, 1_900_000), (-9.0, 1_100_000)] {
            servo.steer(angle);
            assert_eq!((chip.read("duty_cycle"), chip.read("enable")), (pulse, 1));
        }
        servo.steer(f64::NAN);
        assert_eq!(chip.read("duty_cycle"), 1_100_000, "it keeps its angle");
        drop(servo);
        assert_eq!(chip.read("enable"), 0);
    }

    #[test]
    fn the_angle_takes_the_time_that_the_servo_needs() {
        let chip = Chip::new("rate");
        let mut servo = PwmServo::open(&chip.0, 3, CONFIG).unwrap();
        let start = Instant::now();
        servo.handle_time(start);
        servo.steer(0.5);
        servo.handle_time(start + Duration::from_millis(100));
        assert!((servo.angle() - 0.2).abs() < 1e-9, "{}", servo.angle());
    }

    #[test]
    fn an_output_that_is_gone_is_a_fault_until_it_is_back() {
        let chip = Chip::new("gone");
        let mut servo = PwmServo::open(&chip.0, 3, CONFIG).unwrap();
        let (here, away) = (chip.0.join("pwm3"), chip.0.join("away"));
        fs::rename(&here, &away).unwrap();
        servo.steer(0.1);
        assert!(
            servo
                .fault()
                .unwrap()
                .contains("cannot set the steering servo")
        );
        fs::rename(&away, &here).unwrap();
        servo.handle_time(Instant::now());
        assert_eq!(servo.fault(), None);
    }

    #[test]
    fn a_chip_that_does_not_exist_is_named() {
        let error = PwmServo::open(Path::new("/nowhere"), 0, CONFIG).unwrap_err();
        assert!(
            error.to_string().contains("PWM output 0 of /nowhere"),
            "{error}"
        );
    }
}
