//! What is started, started again, given up and stopped, and when: the decisions of `jaus up`,
//! without a process and without a clock. Parts are known by their place in the system.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::system::Restart;

/// How long a part must have run to count as one that works.
pub(super) const SETTLED: Duration = Duration::from_secs(10);
/// The pause before a part is started again …
const FIRST_PAUSE: Duration = Duration::from_millis(500);
/// … which doubles with each time that it did not settle, up to this.
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// The exit status of a program that could not begin, because its flags or settings are wrong.
const CANNOT_BEGIN: i32 = 2;

/// How a process came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
    Status(i32),
    /// By the signal with this number.
    Signal(i32),
    /// It never began.
    NotStarted,
}

/// What the owner must do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Start(usize),
    /// Ask it to end.
    Terminate(usize),
    /// Do not ask.
    Kill(usize),
}

/// What people should know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum News {
    /// It has ended, and is started again after a pause.
    Restarts {
        part: usize,
        exit: Exit,
        ran: Duration,
        pause: Duration,
    },
    /// It has ended, and stays so.
    Ended { part: usize, exit: Exit },
    /// It says that it cannot begin, and starting it again would not help.
    GaveUp { part: usize },
    /// It did not end when it was asked to, and is killed.
    Killed { part: usize },
    /// It did not even end then.
    Stuck { part: usize },
}

/// How it stands with a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Waiting {
        until: Instant,
    },
    /// It is to be started, and the owner has not told yet whether that went well.
    Starting,
    Running {
        since: Instant,
    },
    Stopping {
        until: Instant,
        killed: bool,
    },
    /// It has ended, as it may.
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
    /// How often in a row it has ended before it had settled.
    failures: u32,
    /// Whether it has ever settled.
    proven: bool,
    last: Option<Exit>,
}

impl Supervisor {
    /// Parts that are all due at once, and how long one may take to end.
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

    /// The process of a part has begun.
    pub(super) fn handle_started(&mut self, now: Instant, part: usize) {
        let Some(it) = self.parts.get_mut(part) else {
            return;
        };
        it.starts = it.starts.saturating_add(1);
        it.state = State::Running { since: now };
    }

    /// The process of a part has ended, or never began.
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

    /// Everything is to end: the last part first, each when the one after it has ended.
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

    /// Everything is to end, and at once.
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

    /// The time of [`poll_timeout`](Self::poll_timeout) has come.
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

    /// Whether nothing runs any more and nothing will.
    pub(super) fn is_over(&self) -> bool {
        let over = |it: &Part| matches!(it.state, State::Ended | State::GivenUp | State::Stopped);
        self.parts.iter().all(over)
    }

    /// Whether every part has done what it was to do, as far as is known.
    pub(super) fn went_well(&self) -> bool {
        let well = |it: &Part| match it.state {
            State::Ended => it.last == Some(Exit::Status(0)),
            State::GivenUp => false,
            _ => true,
        };
        self.parts.iter().all(well)
    }

    /// How it stands with a part: its state, how often it was started, and how it ended last.
    pub(super) fn look(&self, part: usize) -> Option<(State, u32, Option<Exit>)> {
        let it = self.parts.get(part)?;
        Some((it.state, it.starts, it.last))
    }

    /// Asks the last part that still runs to end, unless one is being asked. One that had to be
    /// killed holds nobody up.
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
    /// What becomes of it after its process has ended.
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
        // Flags with which it has worked before are not wrong: then something else is in the way,
        // such as a port that is not free yet.
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
