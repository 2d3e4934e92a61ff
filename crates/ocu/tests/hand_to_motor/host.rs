//! A host of the simulation: a tokio runtime with a clock of its own, which runs faster or slower than
//! the true time, and a wall clock that can be stepped. A program of the host is killed by dropping
//! its runtime.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use jaus::node::now;
use jaus::service::TimeOfDay;
use tokio::runtime::{Builder, Runtime};

/// The time of every wall clock at the start of a trial: 2026-01-01 00:00:00 UTC.
const START: Duration = Duration::from_secs(1_767_225_600);

pub(crate) struct Host {
    program: Option<Program>,
    /// Seconds of the host in a second of true time.
    rate: f64,
    /// The true time until which the host has run.
    lived: Duration,
    wall: Arc<Mutex<Wall>>,
}

struct Program {
    runtime: Runtime,
    clock: Instant,
}

/// The wall clock: what it shows at a moment of the program's clock.
struct Wall {
    shows: Duration,
    at: Option<Instant>,
}

impl Host {
    pub(crate) fn new(rate: f64) -> Self {
        let wall = Wall {
            shows: START,
            at: None,
        };
        Self {
            program: None,
            rate,
            lived: Duration::ZERO,
            wall: Arc::new(Mutex::new(wall)),
        }
    }

    /// Starts a program in place of the one that runs. It begins with `main`, and goes on in tasks.
    pub(crate) fn start(&mut self, main: impl FnOnce(TimeOfDay)) {
        let runtime = Builder::new_current_thread()
            .enable_time()
            .start_paused(true)
            .build()
            .expect("a runtime");
        let clock = runtime.block_on(async { now() });
        self.lock().at = Some(clock);
        let wall = Arc::clone(&self.wall);
        let time = TimeOfDay::new(move || {
            let wall = wall.lock().expect("no panic");
            let passed = wall.at.map(|at| now().saturating_duration_since(at));
            wall.shows + passed.unwrap_or_default()
        });
        runtime.block_on(async { main(time) });
        self.program = Some(Program { runtime, clock });
    }

    /// Kills the program, as `kill -9` does. What it holds must have been taken from it before.
    pub(crate) fn kill(&mut self) {
        self.lock().at = None;
        self.program = None;
    }

    pub(crate) const fn is_alive(&self) -> bool {
        self.program.is_some()
    }

    /// Runs something among the program's tasks.
    pub(crate) fn enter<T>(&self, act: impl FnOnce() -> T) -> Option<T> {
        let program = self.program.as_ref()?;
        Some(program.runtime.block_on(async { act() }))
    }

    /// Lives until `end` of the true time.
    pub(crate) fn live(&mut self, end: Duration) {
        let passed = end.saturating_sub(self.lived).mul_f64(self.rate);
        self.lived = end;
        if let Some(program) = &mut self.program {
            program.clock += passed;
            let until = program.clock.into();
            let sleep = async { tokio::time::sleep_until(until).await };
            program.runtime.block_on(sleep);
        }
        let clock = self.program.as_ref().map(|it| it.clock);
        let mut wall = self.lock();
        wall.shows += passed;
        wall.at = clock;
    }

    /// From now on the clocks run at this rate.
    pub(crate) const fn slew(&mut self, rate: f64) {
        self.rate = rate;
    }

    /// Steps the wall clock.
    pub(crate) fn step_clock(&self, seconds: f64) {
        let mut wall = self.lock();
        let step = Duration::from_secs_f64(seconds.abs());
        wall.shows = if seconds < 0.0 {
            wall.shows.saturating_sub(step)
        } else {
            wall.shows + step
        };
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Wall> {
        self.wall.lock().expect("no panic")
    }
}
