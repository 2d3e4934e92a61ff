//! The thread that sends a stepper motor its pulses: nothing else of the program holds them up, and
//! they end with it.
#![expect(
    clippy::disallowed_methods,
    reason = "pulses are made in real time, on a thread of their own"
)]

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{Actuator, Command, Stepper, StepperConfig, StepperPoll};

/// The lines to the driver of a stepper motor.
pub trait Lines: Send {
    /// Which way the next pulses turn the motor.
    ///
    /// # Errors
    /// If the line can not be set.
    fn set_direction(&mut self, backwards: bool) -> io::Result<()>;

    /// Begins or ends a pulse.
    ///
    /// # Errors
    /// If the line can not be set.
    fn set_step(&mut self, high: bool) -> io::Result<()>;
}

/// A stepper motor on its lines.
pub struct PulseMotor {
    shared: Arc<Shared>,
    steps_per_metre: f64,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    news: Condvar,
}

#[derive(Default)]
struct State {
    command: Command,
    steps: i64,
    fault: Option<String>,
    ends: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PulseMotor {
    /// How long a pulse lasts at least, and how long the direction is set before it: what slow
    /// drivers need.
    const PULSE: Duration = Duration::from_micros(5);

    /// A motor at rest, on these lines.
    ///
    /// # Errors
    /// If the system has no thread left.
    pub fn start(config: StepperConfig, lines: impl Lines + 'static) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            news: Condvar::new(),
        });
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("pulses".to_owned())
            .spawn(move || run(&of_thread, Stepper::new(config), lines))?;
        Ok(Self {
            shared,
            steps_per_metre: config.steps_per_metre,
            thread: Some(thread),
        })
    }
}

impl Actuator for PulseMotor {
    fn handle_time(&mut self, _: Instant) {}

    fn command(&mut self, command: Command) {
        let mut state = self.shared.lock();
        if state.command != command {
            state.command = command;
            self.shared.news.notify_one();
        }
    }

    fn travel(&self) -> f64 {
        self.shared.lock().steps as f64 / self.steps_per_metre
    }

    fn fault(&self) -> Option<String> {
        self.shared.lock().fault.clone()
    }
}

impl Drop for PulseMotor {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
        self.shared.news.notify_one();
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked sends no pulses either.
            let _ = thread.join();
        }
    }
}

/// Sends pulses until the motor is dropped or a line can not be set.
fn run(shared: &Shared, mut stepper: Stepper, mut lines: impl Lines) {
    let mut direction = None;
    let mut state = shared.lock();
    while !state.ends {
        stepper.command(state.command);
        let now = Instant::now();
        match stepper.poll(now) {
            StepperPoll::Wait(None) => {
                state = match shared.news.wait(state) {
                    Ok(state) => state,
                    Err(poisoned) => poisoned.into_inner(),
                };
            }
            StepperPoll::Wait(Some(next)) => {
                let pause = next.saturating_duration_since(now);
                state = match shared.news.wait_timeout(state, pause) {
                    Ok((state, _)) => state,
                    Err(poisoned) => poisoned.into_inner().0,
                };
            }
            StepperPoll::Step { backwards } => {
                drop(state);
                let sent = pulse(&mut lines, backwards, &mut direction);
                state = shared.lock();
                if let Err(error) = sent {
                    state.fault = Some(format!("the motor's lines can not be set: {error}"));
                    return;
                }
                state.steps = stepper.steps();
            }
        }
    }
}

fn pulse(lines: &mut impl Lines, backwards: bool, direction: &mut Option<bool>) -> io::Result<()> {
    if *direction != Some(backwards) {
        lines.set_direction(backwards)?;
        *direction = Some(backwards);
        wait(PulseMotor::PULSE);
    }
    lines.set_step(true)?;
    wait(PulseMotor::PULSE);
    lines.set_step(false)
}

/// Waits for less than a scheduler would.
fn wait(duration: Duration) {
    let start = Instant::now();
    while start.elapsed() < duration {
        std::hint::spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chip that keeps what its lines were set to, and breaks after so many pulses.
    #[derive(Clone)]
    struct Chip {
        pulses: Arc<Mutex<Vec<bool>>>,
        backwards: bool,
        lasts: usize,
    }

    impl Chip {
        fn lasting(lasts: usize) -> Self {
            Self {
                pulses: Arc::default(),
                backwards: false,
                lasts,
            }
        }
    }

    impl Lines for Chip {
        fn set_direction(&mut self, backwards: bool) -> io::Result<()> {
            self.backwards = backwards;
            Ok(())
        }

        fn set_step(&mut self, high: bool) -> io::Result<()> {
            let mut pulses = self.pulses.lock().unwrap();
            if pulses.len() >= self.lasts {
                return Err(io::Error::other("the chip is gone"));
            }
            if high {
                pulses.push(self.backwards);
            }
            Ok(())
        }
    }

    fn drive(drive: f64) -> Command {
        Command { drive, brake: 0.0 }
    }

    fn wait_until(is_so: impl Fn() -> bool) {
        let start = Instant::now();
        while !is_so() {
            assert!(start.elapsed() < Duration::from_secs(20), "waited in vain");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn pulses_come_both_ways_and_what_is_told_as_travel_is_what_was_sent() {
        let chip = Chip::lasting(usize::MAX);
        let mut motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        motor.command(drive(0.2));
        wait_until(|| motor.travel() > 0.02);
        motor.command(drive(-0.2));
        wait_until(|| motor.travel() < 0.0);
        let travel = motor.travel();
        drop(motor);
        let pulses = chip.pulses.lock().unwrap();
        let sent = pulses
            .iter()
            .map(|&backwards| if backwards { -1.0 } else { 1.0 });
        let sent = sent.sum::<f64>() / StepperConfig::default().steps_per_metre;
        assert!(
            (sent - travel).abs() < 0.2,
            "{sent} m sent, {travel} m told"
        );
        assert!(pulses.contains(&true) && pulses.contains(&false));
    }

    #[test]
    fn no_pulse_comes_without_a_command_nor_after_the_end() {
        let chip = Chip::lasting(usize::MAX);
        let motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        drop(motor);
        assert!(chip.pulses.lock().unwrap().is_empty());
    }

    #[test]
    fn a_chip_that_breaks_is_a_fault_that_is_told() {
        let mut motor = PulseMotor::start(StepperConfig::default(), Chip::lasting(5)).unwrap();
        motor.command(drive(1.0));
        wait_until(|| motor.fault().is_some());
        assert!(motor.fault().unwrap().contains("the chip is gone"));
    }
}
