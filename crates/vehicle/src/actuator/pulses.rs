//! The thread that sends pulses to a stepper motor. The rest of the program cannot delay the
//! pulses. They end with the program, and also when the program hangs and repeats no command.
#![expect(
    clippy::disallowed_methods,
    reason = "pulses are generated in real time, on their own thread"
)]

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{Actuator, Command, Stepper, StepperConfig, StepperPoll};
use crate::motion::CommandDeadline;

/// The lines to a stepper motor driver.
pub trait Lines: Send {
    /// Sets the direction of the following pulses.
    ///
    /// # Errors
    /// If the line cannot be set.
    fn set_direction(&mut self, backwards: bool) -> io::Result<()>;

    /// Starts or ends a pulse.
    ///
    /// # Errors
    /// If the line cannot be set.
    fn set_step(&mut self, high: bool) -> io::Result<()>;
}

/// A stepper motor driven through its lines. Dropping it ramps the motor down to a stop and waits
/// for the ramp: half a second with the default settings, 2 s at most.
pub struct PulseMotor {
    shared: Arc<Shared>,
    steps_per_metre: f64,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    news: Condvar,
}

struct State {
    command: Command,
    deadline: CommandDeadline,
    steps: i64,
    fault: Option<String>,
    /// When the motor was dropped.
    ends: Option<Instant>,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn new(deadline: Duration) -> Self {
        Self {
            command: Command::STOP,
            deadline: CommandDeadline::new(deadline),
            steps: 0,
            fault: None,
            ends: None,
        }
    }

    /// The command in force: stop, if the last command has expired.
    fn command_at(&mut self, now: Instant) -> Command {
        if self.command != Command::STOP && self.deadline.has_passed(now) {
            tracing::warn!("watchdog: the motor stops because its command was not repeated");
            self.command = Command::STOP;
        }
        self.command
    }

    /// Whether the time allowed for the last ramp is over.
    fn has_ramped_down(&self, now: Instant) -> bool {
        let since = |ends| now.saturating_duration_since(ends);
        self.ends
            .is_some_and(|ends| since(ends) > PulseMotor::LAST_RAMP)
    }

    /// Next wake-up: at the next pulse, or when the command expires.
    fn wakes_at(&self, next: Option<Instant>) -> Option<Instant> {
        let expires = self.deadline.expires_at();
        let expires = expires.filter(|_| self.command != Command::STOP);
        [next, expires].into_iter().flatten().min()
    }
}

impl PulseMotor {
    /// Interval between attempts to use lines that could not be set.
    const RETRY: Duration = Duration::from_secs(1);
    /// Maximum time for a dropped motor to ramp down to a stop.
    const LAST_RAMP: Duration = Duration::from_secs(2);
    /// Minimum pulse length, and setup time of the direction line before a pulse. Sufficient for
    /// slow drivers.
    const PULSE: Duration = Duration::from_micros(5);

    /// Starts a motor at rest on the given lines.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub fn start(config: StepperConfig, lines: impl Lines + 'static) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            state: Mutex::new(State::new(config.deadline)),
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
        state.deadline.restart(Some(Instant::now()));
        if state.command != command {
            state.command = command;
            self.shared.news.notify_one();
        }
    }

    fn travel(&self) -> f64 {
        self.shared.lock().steps as f64 / self.steps_per_metre
    }

    fn fault(&self) -> Option<String> {
        let fault = self.shared.lock().fault.clone();
        let has_ended = self.thread.as_ref().is_some_and(JoinHandle::is_finished);
        fault.or_else(|| has_ended.then(|| "the thread that sends pulses has ended".to_owned()))
    }
}

impl Drop for PulseMotor {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.ends = Some(Instant::now());
        state.command = Command::STOP;
        drop(state);
        self.shared.news.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panicked thread sends no pulses either.
            let _ = thread.join();
        }
    }
}

/// Sends pulses until the motor is dropped, then those of the final ramp. While a line cannot be
/// set, the motor stands still and reports a fault.
fn run(shared: &Shared, mut stepper: Stepper, mut lines: impl Lines) {
    let mut direction = None;
    let mut state = shared.lock();
    loop {
        let now = Instant::now();
        stepper.command(state.command_at(now));
        match stepper.poll(now) {
            StepperPoll::Wait(None) if state.ends.is_some() => return,
            _ if state.has_ramped_down(now) => return,
            StepperPoll::Wait(next) => {
                let wake = state.wakes_at(next);
                state = wait_for_command(shared, state, wake, now);
            }
            StepperPoll::Step { backwards } => {
                drop(state);
                let sent = pulse(&mut lines, backwards, &mut direction);
                state = shared.lock();
                if let Err(error) = sent {
                    state.fault = Some(format!("cannot set the motor's lines: {error}"));
                    state = mend(shared, state, &mut lines);
                    // Restarts from rest. The failed pulse is not counted.
                    stepper = stepper.at_rest(state.steps);
                    direction = None;
                } else {
                    state.steps = stepper.steps();
                }
            }
        }
    }
}

/// Waits until the lines can be set again or the motor is dropped. Commands received meanwhile are
/// discarded.
fn mend<'a>(
    shared: &'a Shared,
    mut state: MutexGuard<'a, State>,
    lines: &mut impl Lines,
) -> MutexGuard<'a, State> {
    let mut retry = Instant::now() + PulseMotor::RETRY;
    while state.ends.is_none() {
        let now = Instant::now();
        if now < retry {
            state = wait_for_command(shared, state, Some(retry), now);
            continue;
        }
        drop(state);
        let works = lines.set_step(false).is_ok();
        state = shared.lock();
        if works {
            state.fault = None;
            break;
        }
        retry = now + PulseMotor::RETRY;
    }
    state.command = Command::STOP;
    state
}

/// Waits for a new command or the drop of the motor, at most until `wake`.
fn wait_for_command<'a>(
    shared: &'a Shared,
    state: MutexGuard<'a, State>,
    wake: Option<Instant>,
    now: Instant,
) -> MutexGuard<'a, State> {
    let Some(wake) = wake else {
        let state = shared.news.wait(state);
        return state.unwrap_or_else(PoisonError::into_inner);
    };
    let pause = wake.saturating_duration_since(now);
    match shared.news.wait_timeout(state, pause) {
        Ok((state, _)) => state,
        Err(poisoned) => poisoned.into_inner().0,
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

/// Busy-waits, because the time is shorter than the scheduler can sleep.
fn wait(duration: Duration) {
    let start = Instant::now();
    while start.elapsed() < duration {
        std::hint::spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records the pulses and fails after a limited number.
    #[derive(Clone)]
    struct Chip {
        pulses: Arc<Mutex<Vec<bool>>>,
        backwards: bool,
        lasts: Arc<Mutex<usize>>,
    }

    impl Chip {
        fn lasting(lasts: usize) -> Self {
            Self {
                pulses: Arc::default(),
                backwards: false,
                lasts: Arc::new(Mutex::new(lasts)),
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
            if pulses.len() >= *self.lasts.lock().unwrap() {
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

    /// Repeats a command as a pilot does, until the condition holds.
    fn command_until(motor: &mut PulseMotor, share: f64, is_so: impl Fn(&PulseMotor) -> bool) {
        let start = Instant::now();
        while !is_so(motor) {
            motor.command(drive(share));
            assert!(start.elapsed() < Duration::from_secs(20), "waited in vain");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn reported_travel_equals_the_pulses_sent_in_both_directions() {
        let chip = Chip::lasting(usize::MAX);
        let mut motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        command_until(&mut motor, 0.2, |motor| motor.travel() > 0.02);
        command_until(&mut motor, -0.2, |motor| motor.travel() < 0.0);
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
    fn no_pulse_is_sent_before_a_command_or_after_the_drop() {
        let chip = Chip::lasting(usize::MAX);
        let motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        drop(motor);
        assert!(chip.pulses.lock().unwrap().is_empty());
    }

    #[test]
    fn pulses_end_when_the_program_hangs() {
        let chip = Chip::lasting(usize::MAX);
        let mut motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        command_until(&mut motor, 0.2, |motor| motor.travel() > 0.02);
        // The program hangs here: no command is repeated. Expected: 0.2 s deadline and a ramp of
        // 0.1 s.
        let (mut sent, start) = (0, Instant::now());
        while std::mem::replace(&mut sent, chip.pulses.lock().unwrap().len()) != sent {
            assert!(start.elapsed() < Duration::from_secs(20), "it still turns");
            std::thread::sleep(Duration::from_millis(200));
        }
        command_until(&mut motor, 0.2, |motor| motor.travel() > 0.5);
    }

    #[test]
    fn a_motor_that_is_dropped_ramps_down() {
        let chip = Chip::lasting(usize::MAX);
        let mut motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        command_until(&mut motor, 1.0, |motor| motor.travel() > 0.3);
        let before = chip.pulses.lock().unwrap().len();
        drop(motor);
        // 0.77 m/s at 2 m/s² is 0.15 m. Part of it was driven before the thread noticed the drop.
        let ramp = chip.pulses.lock().unwrap().len() - before;
        assert!(ramp > 150, "{ramp} pulses");
    }

    #[test]
    fn a_broken_chip_is_a_fault_until_it_recovers() {
        let chip = Chip::lasting(5);
        let mut motor = PulseMotor::start(StepperConfig::default(), chip.clone()).unwrap();
        command_until(&mut motor, 1.0, |motor| motor.fault().is_some());
        assert!(motor.fault().unwrap().contains("the chip is gone"));
        *chip.lasts.lock().unwrap() = usize::MAX;
        command_until(&mut motor, 1.0, |motor| motor.fault().is_none());
        command_until(&mut motor, 1.0, |motor| motor.travel() > 0.02);
    }
}
