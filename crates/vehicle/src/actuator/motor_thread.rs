//! The thread that keeps motors on a line commanded: it repeats their setpoints, lets them expire, and
//! keeps what the line reports.
#![expect(
    clippy::disallowed_methods,
    reason = "serves the line in real time, on its own thread"
)]

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::{Actuator, Command, MotorConfig, SimulatedMotor};
use crate::motion::CommandDeadline;

/// A line or bus with the controllers of one or more motors.
pub(super) trait MotorLine: Send + 'static {
    /// Name of the thread.
    const NAME: &'static str;
    /// Interval between two exchanges.
    const PERIOD: Duration;

    /// Commands a share of full speed, -1 to 1, to each motor; 0 brakes. Takes what was received.
    ///
    /// # Errors
    /// The fault, as text for the operator.
    fn exchange(&mut self, now: Instant, shares: &[f64]) -> Result<(), String>;

    /// The travel of a motor in metres, if the line reports it.
    fn travel(&self, _motor: usize) -> f64 {
        0.0
    }
}

/// The thread of a line. When it is dropped, all motors are commanded to stop; a line that takes no
/// data delays that for no longer than [`FAREWELL`](Self::FAREWELL).
pub(super) struct MotorThread {
    shared: Arc<Shared>,
}

struct Shared {
    state: Mutex<State>,
    news: Condvar,
}

struct State {
    motors: Vec<Motor>,
    fault: Option<String>,
    /// When the thread last returned from the line.
    served_at: Instant,
    ends: bool,
    /// Whether the thread has ended and given up the line.
    has_ended: bool,
}

#[derive(Clone, Copy)]
struct Motor {
    share: f64,
    deadline: CommandDeadline,
    travel: f64,
}

impl Motor {
    /// The share of full speed in force: 0, if the last command has expired.
    fn share_at(&mut self, now: Instant) -> f64 {
        if self.share != 0.0 && self.deadline.has_passed(now) {
            tracing::warn!("watchdog: the motor stops because its command was not repeated");
            self.share = 0.0;
        }
        self.share
    }
}

impl MotorThread {
    /// A thread that has not returned from the line for this time is stuck.
    const STUCK: Duration = Duration::from_millis(500);
    /// At the end, the stop is waited for this long. Without it, the controller's own timeout stops
    /// the motors.
    const FAREWELL: Duration = Duration::from_secs(1);

    /// Starts the thread for this number of motors, whose commands expire after `deadline`.
    pub(super) fn start<L: MotorLine>(
        line: L,
        motors: usize,
        deadline: Duration,
    ) -> io::Result<Arc<Self>> {
        let motor = Motor {
            share: 0.0,
            deadline: CommandDeadline::new(deadline),
            travel: 0.0,
        };
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                motors: vec![motor; motors],
                fault: None,
                served_at: Instant::now(),
                ends: false,
                has_ended: false,
            }),
            news: Condvar::new(),
        });
        let of_thread = Arc::clone(&shared);
        std::thread::Builder::new()
            .name(L::NAME.to_owned())
            .spawn(move || {
                let end = End(of_thread);
                run(&end.0, line);
            })?;
        Ok(Arc::new(Self { shared }))
    }

    /// Sets the command of a motor.
    pub(super) fn command(&self, motor: usize, command: Command) {
        let mut state = self.shared.lock();
        let Some(motor) = state.motors.get_mut(motor) else {
            return;
        };
        let share = command.drive.clamp(-1.0, 1.0) * (1.0 - command.brake.clamp(0.0, 1.0));
        motor.deadline.restart(Some(Instant::now()));
        if motor.share != share {
            motor.share = share;
            self.shared.news.notify_one();
        }
    }

    /// The travel of a motor as last reported, in metres.
    pub(super) fn travel(&self, motor: usize) -> f64 {
        let state = self.shared.lock();
        state.motors.get(motor).map_or(0.0, |motor| motor.travel)
    }

    /// The fault of the line, or of any motor on it.
    pub(super) fn fault(&self) -> Option<String> {
        let state = self.shared.lock();
        let is_stuck = state.served_at.elapsed() > Self::STUCK;
        let stuck = || is_stuck.then(|| "the motor controller's line takes no data".to_owned());
        state.fault.clone().or_else(stuck)
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Tells the end of the thread, also that of one that panics.
struct End(Arc<Shared>);

impl Drop for End {
    fn drop(&mut self) {
        self.0.lock().has_ended = true;
        self.0.news.notify_all();
    }
}

impl Drop for MotorThread {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.ends = true;
        self.shared.news.notify_all();
        let news = &self.shared.news;
        let waited = news.wait_timeout_while(state, Self::FAREWELL, |it| !it.has_ended);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if !state.has_ended {
            tracing::error!("the motor controller's line takes no data: no stop was commanded");
        }
    }
}

/// A motor on a line that does not report its travel: it is estimated from the commands, with the lag
/// of a [`SimulatedMotor`]. When all motors of a line are dropped, they are commanded to stop.
pub struct OpenLoopMotor {
    line: Arc<MotorThread>,
    index: usize,
    /// Estimates the travel.
    model: SimulatedMotor,
}

impl OpenLoopMotor {
    pub(super) fn start<L: MotorLine, const N: usize>(
        line: L,
        config: MotorConfig,
    ) -> io::Result<[Self; N]> {
        let line = MotorThread::start(line, N, config.deadline)?;
        Ok(std::array::from_fn(|index| Self {
            line: Arc::clone(&line),
            index,
            model: SimulatedMotor::new(config),
        }))
    }
}

impl Actuator for OpenLoopMotor {
    fn handle_time(&mut self, now: Instant) {
        self.model.handle_time(now);
    }

    fn command(&mut self, command: Command) {
        let command = command.or_stop();
        self.model.command(command);
        self.line.command(self.index, command);
    }

    fn travel(&self) -> f64 {
        self.model.travel()
    }

    fn fault(&self) -> Option<String> {
        self.line.fault()
    }
}

/// Serves the line until the motors are dropped, and then commands a stop.
fn run<L: MotorLine>(shared: &Shared, mut line: L) {
    loop {
        let now = Instant::now();
        let mut state = shared.lock();
        let ends = state.ends;
        let shares: Vec<_> = state
            .motors
            .iter_mut()
            .map(|motor| if ends { 0.0 } else { motor.share_at(now) })
            .collect();
        drop(state);
        let result = line.exchange(now, &shares);
        if ends {
            return;
        }
        let mut state = shared.lock();
        state.fault = result.err();
        state.served_at = Instant::now();
        for (index, motor) in state.motors.iter_mut().enumerate() {
            motor.travel = line.travel(index);
        }
        if !state.ends {
            let woken = shared.news.wait_timeout(state, L::PERIOD);
            drop(woken.unwrap_or_else(PoisonError::into_inner));
        }
    }
}
