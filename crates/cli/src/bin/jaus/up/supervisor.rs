//! Supervisor of `jaus up`: decides when parts start, restart, stop and are given up, without
//! processes and without a clock. Parts are identified by their index in the system.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::system::Restart;

/// Running time after which a part counts as working.
pub(super) const SETTLED: Duration = Duration::from_secs(10);
/// First pause before a restart …
const FIRST_PAUSE: Duration = Duration::from_millis(500);
/// … which doubles with each unsettled run, up to this.
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// Exit status of a program that could not start, because of its flags or settings.
const CANNOT_BEGIN: i32 = 2;

/// Exit of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
    Status(i32),
    /// By the signal with this number.
    Signal(i32),
    /// It was never started.
    NotStarted,
}

/// Order to the owner of the processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Start(usize),
    /// Ask it to end.
    Terminate(usize),
    /// Kill it.
    Kill(usize),
}

/// News for the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum News {
    /// It has ended and will restart after a pause.
    Restarts {
        part: usize,
        exit: Exit,
        ran: Duration,
        pause: Duration,
    },
    /// It has ended and stays stopped.
    Ended { part: usize, exit: Exit },
    /// It cannot start, and a restart would not help.
    GaveUp { part: usize },
    /// It did not end in time, and is killed.
    Killed { part: usize },
    /// It did not end even after the kill.
    Stuck { part: usize },
}

/// State of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Waiting {
        until: Instant,
    },
    /// It is being started; the result is still open.
    Starting,
    Running {
        since: Instant,
    },
    Stopping {
        until: Instant,
        killed: bool,
    },
    /// It has ended as intended.
    Ended,
    GivenUp,
    Stopped,
}

/// The state machine.
#[derive(Debug)]
pub(super) struct Supervisor {
    parts: Vec<Part>,
    grace: Duration,
    stopping: bool,
    orders: VecDeque<Order>,
    news: VecDeque<News>,
}

#[derive(Debug)]
struct Part {
    restart: Restart,
    state: State,
    starts: u32,
    /// Number of consecutive runs that ended before they settled.
    failures: u32,
    /// Whether it has ever settled.
    proven: bool,
    last: Option<Exit>,
}

impl Supervisor {
    /// All parts are due at once; `grace` is the time limit to end.
    pub(super) fn new(
        now: Instant,
        parts: impl IntoIterator<Item = Restart>,
        grace: Duration,
    ) -> Self {
        let part = |restart| Part {
            restart,
            state: State::Waiting { until: now },
            starts: 0,
            failures: 0,
            proven: false,
            last: None,
        };
        Self {
            parts: parts.into_iter().map(part).collect(),
            grace,
            stopping: false,
            orders: VecDeque::new(),
            news: VecDeque::new(),
        }
    }

    /// Notes the start of a part's process.
    pub(super) fn handle_started(&mut self, now: Instant, part: usize) {
        let Some(it) = self.parts.get_mut(part) else {
            return;
        };
        it.starts = it.starts.saturating_add(1);
        it.state = State::Running { since: now };
    }

    /// Handles the exit of a part's process, or its failed start.
    pub(super) fn handle_exit(&mut self, now: Instant, part: usize, exit: Exit) {
        let stopping = self.stopping;
        let Some(it) = self.parts.get_mut(part) else {
            return;
        };
        it.last = Some(exit);
        if stopping {
            it.state = State::Stopped;
            return self.stop_next(now);
        }
        let news = it.decide(now, part, exit);
        self.news.push_back(news);
    }

    /// Stops all parts: the last one first, each after its successor has ended.
    pub(super) fn stop(&mut self, now: Instant) {
        if self.stopping {
            return;
        }
        self.stopping = true;
        for it in &mut self.parts {
            if matches!(it.state, State::Waiting { .. } | State::Starting) {
                it.state = State::Stopped;
            }
        }
        self.orders
            .retain(|order| !matches!(order, Order::Start(_)));
        self.stop_next(now);
    }

    /// Kills all parts at once.
    pub(super) fn hurry(&mut self, now: Instant) {
        self.stop(now);
        let until = now + self.grace;
        for (part, it) in self.parts.iter_mut().enumerate().rev() {
            if let State::Running { .. } | State::Stopping { killed: false, .. } = it.state {
                it.state = State::Stopping {
                    until,
                    killed: true,
                };
                self.orders.push_back(Order::Kill(part));
            }
        }
    }

    /// Runs due timers.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        for (part, it) in self.parts.iter_mut().enumerate() {
            match it.state {
                State::Waiting { until } if until <= now => {
                    it.state = State::Starting;
                    self.orders.push_back(Order::Start(part));
                }
                State::Stopping { until, killed } if until <= now => {
                    if killed {
                        it.state = State::Stopped;
                        self.news.push_back(News::Stuck { part });
                    } else {
                        it.state = State::Stopping {
                            until: now + self.grace,
                            killed: true,
                        };
                        self.orders.push_back(Order::Kill(part));
                        self.news.push_back(News::Killed { part });
                    }
                }
                _ => {}
            }
        }
        if self.stopping {
            self.stop_next(now);
        }
    }

    /// When to be woken.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let due = self.parts.iter().filter_map(|it| match it.state {
            State::Waiting { until } | State::Stopping { until, .. } => Some(until),
            _ => None,
        });
        due.min()
    }

    pub(super) fn poll_order(&mut self) -> Option<Order> {
        self.orders.pop_front()
    }

    pub(super) fn poll_news(&mut self) -> Option<News> {
        self.news.pop_front()
    }

    /// Whether all parts have ended for good.
    pub(super) fn is_over(&self) -> bool {
        let over = |it: &Part| matches!(it.state, State::Ended | State::GivenUp | State::Stopped);
        self.parts.iter().all(over)
    }

    /// Whether every part succeeded, as far as known.
    pub(super) fn went_well(&self) -> bool {
        let well = |it: &Part| match it.state {
            State::Ended => it.last == Some(Exit::Status(0)),
            State::GivenUp => false,
            _ => true,
        };
        self.parts.iter().all(well)
    }

    /// State of a part, its number of starts, and its last exit.
    pub(super) fn look(&self, part: usize) -> Option<(State, u32, Option<Exit>)> {
        let it = self.parts.get(part)?;
        Some((it.state, it.starts, it.last))
    }

    /// Stops the last running part, unless one is being stopped. A part that had to be killed does
    /// not block the others.
    fn stop_next(&mut self, now: Instant) {
        let asked = |it: &Part| matches!(it.state, State::Stopping { killed: false, .. });
        if self.parts.iter().any(asked) {
            return;
        }
        let running = |it: &Part| matches!(it.state, State::Running { .. });
        let Some(part) = self.parts.iter().rposition(running) else {
            return;
        };
        if let Some(it) = self.parts.get_mut(part) {
            it.state = State::Stopping {
                until: now + self.grace,
                killed: false,
            };
            self.orders.push_back(Order::Terminate(part));
        }
    }
}

impl Part {
    /// Decides the next state after an exit.
    fn decide(&mut self, now: Instant, part: usize, exit: Exit) -> News {
        let ran = match self.state {
            State::Running { since } => now.saturating_duration_since(since),
            _ => Duration::ZERO,
        };
        if ran >= SETTLED {
            self.proven = true;
            self.failures = 0;
        }
        let wanted = match self.restart {
            Restart::Always => true,
            Restart::OnFailure => exit != Exit::Status(0),
            Restart::Never => false,
        };
        if !wanted {
            self.state = State::Ended;
            return News::Ended { part, exit };
        }
        // A part that has worked with these flags has another problem, such as a port that is not
        // free yet.
        if exit == Exit::Status(CANNOT_BEGIN) && !self.proven {
            self.state = State::GivenUp;
            return News::GaveUp { part };
        }
        let factor = 2_u32.saturating_pow(self.failures.min(16));
        let pause = FIRST_PAUSE.saturating_mul(factor).min(LONGEST_PAUSE);
        self.failures = self.failures.saturating_add(1);
        self.state = State::Waiting { until: now + pause };
        News::Restarts {
            part,
            exit,
            ran,
            pause,
        }
    }
}

#[cfg(test)]
#[path = "supervisor_tests.rs"]
mod tests;
