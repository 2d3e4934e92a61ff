//! Motors on H-bridges with two PWM outputs each, one for each direction.
//!
//! A bridge knows no timeout. The thread that writes stops the motors when the program hangs, and
//! dropping them ends the pulses, but the kernel keeps the last pulse length when the program is
//! killed. Something outside must then switch the outputs off, such as the unit of the program.

use std::io;
use std::time::{Duration, Instant};

use super::motor_thread::MotorLine;
use super::{MotorConfig, OpenLoopMotor, PwmOutput};

/// An H-bridge: the outputs that turn its motor ahead and back. While both are off, the motor brakes
/// or coasts, as the bridge does.
#[derive(Debug)]
pub struct HBridge {
    /// The output that turns the motor ahead.
    pub ahead: PwmOutput,
    /// The output that turns the motor back.
    pub back: PwmOutput,
}

impl OpenLoopMotor {
    /// Starts the motors of `N` H-bridges; one without a bridge does not turn.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub fn h_bridges<const N: usize>(
        bridges: Vec<HBridge>,
        config: MotorConfig,
    ) -> io::Result<[Self; N]> {
        Self::start(bridges, config)
    }
}

impl HBridge {
    /// Switches one output off before the other one on: both on would brake with full current.
    fn drive(&mut self, share: f64) -> io::Result<()> {
        let (on, off) = match share >= 0.0 {
            true => (&mut self.ahead, &mut self.back),
            false => (&mut self.back, &mut self.ahead),
        };
        off.set_share(0.0)?;
        on.set_share(share.abs())
    }
}

impl MotorLine for Vec<HBridge> {
    const NAME: &'static str = "h-bridges";
    const PERIOD: Duration = Duration::from_millis(20);

    fn exchange(&mut self, _: Instant, shares: &[f64]) -> Result<(), String> {
        let mut written = Ok(());
        for (bridge, &share) in self.iter_mut().zip(shares) {
            // Also the others, if one cannot be written.
            written = bridge.drive(share).and(written);
        }
        written.map_err(|error| format!("cannot write a motor's PWM output: {error}"))
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::actuator::pwm_output::tests::Chip;

    fn bridge(chip: &Chip, ahead: u32, back: u32) -> HBridge {
        let open = |output| PwmOutput::open(&chip.0, output, Duration::from_micros(50)).unwrap();
        HBridge {
            ahead: open(ahead),
            back: open(back),
        }
    }

    #[test]
    fn one_output_of_a_bridge_has_the_share_and_the_other_is_off() {
        let chip = Chip::new("bridge", &[0, 1, 2, 3]);
        let mut line = vec![bridge(&chip, 0, 1), bridge(&chip, 2, 3)];
        let now = Instant::now();
        for (shares, pulses) in [
            ([0.5, -1.0], [25_000, 0, 0, 50_000]),
            ([-0.5, 1.0], [0, 25_000, 50_000, 0]),
            ([0.0, 0.0], [0, 0, 0, 0]),
        ] {
            line.exchange(now, &shares).unwrap();
            let found = [0, 1, 2, 3].map(|output| chip.read(output, "duty_cycle"));
            assert_eq!(found, pulses, "{shares:?}");
        }
        drop(line);
        let enabled = [0, 1, 2, 3].map(|output| chip.read(output, "enable"));
        assert_eq!(enabled, [0; 4]);
    }

    #[test]
    fn an_output_that_cannot_be_written_is_a_fault_and_the_other_motor_is_commanded() {
        let chip = Chip::new("half", &[0, 1, 2, 3]);
        let mut line = vec![bridge(&chip, 0, 1), bridge(&chip, 2, 3)];
        std::fs::rename(chip.0.join("pwm0"), chip.0.join("away")).unwrap();
        let now = Instant::now();
        let fault = line.exchange(now, &[0.5, 0.5]).unwrap_err();
        assert!(
            fault.starts_with("cannot write a motor's PWM output"),
            "{fault}"
        );
        assert_eq!(chip.read(2, "duty_cycle"), 25_000);
        std::fs::rename(chip.0.join("away"), chip.0.join("pwm0")).unwrap();
        assert_eq!(line.exchange(now, &[0.5, 0.5]), Ok(()));
        assert_eq!(chip.read(0, "duty_cycle"), 25_000);
    }
}
