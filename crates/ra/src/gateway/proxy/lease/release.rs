//! Release of an RA component: it is stopped, then released, until it is known to be free.
//!
//! RA components keep their last command: OpenJAUS's primitive driver resumes the last effort as
//! soon as its controller reports ready, its waypoint driver the last speed. A killed gateway
//! therefore leaves components behind that obey its successor with the same id. So each driver is
//! reclaimed when it appears, before a JAUS client gets control of it:
//!
//! 1. Query Component Control reads the controller.
//! 2. OpenJAUS does not answer that. Request Component Control with authority 0 then takes control
//!    from no other controller: a component with another controller rejects it; a free component
//!    and one held in our id confirm it.
//! 3. A component held in our id is stopped and released. The rounds are repeated until Report
//!    Component Control shows another controller or none; a component that does not report it gets
//!    [`ROUNDS`](Release::ROUNDS) of them.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::super::codes::{QUERY_CONTROL, RELEASE_CONTROL, REQUEST_CONTROL, STANDBY};
use crate::RaId;

/// Code and data of a message for the RA component.
type Command = (u16, Bytes);

/// Stop procedure of an RA driver.
#[derive(Debug, Clone, Default)]
pub(in crate::gateway::proxy) struct Halt {
    /// Its stop command, if one works without context. Otherwise Standby stops it.
    pub(in crate::gateway::proxy) command: Option<(u16, Bytes)>,
}

/// Stops and releases one RA component.
#[derive(Debug)]
pub(super) struct Release {
    /// The gateway's RA id.
    own: RaId,
    ra: RaId,
    halt: Option<Halt>,
    state: State,
    /// Whether no client may have control until this is done.
    reclaims: bool,
    /// Whether the component reports its controller.
    reports_control: bool,
    commands: Vec<Command>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Done,
    /// The controller is queried.
    Asking {
        next: Instant,
        asked: u32,
    },
    /// The component is stopped and released.
    Releasing {
        next: Instant,
        rounds: u32,
        standby: Standby,
    },
}

/// Whether a driver is also sent to Standby.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standby {
    /// We had control.
    Send,
    /// It may have been free, and ready for others: only if nothing else stops it.
    Spare,
}

impl Release {
    /// Interval of queries or rounds.
    const INTERVAL: Duration = Duration::from_millis(300);
    /// Number of Query Component Control messages before Request Component Control.
    const QUERIES: u32 = 2;
    /// Rounds for a component that does not report its controller.
    const ROUNDS: u32 = 3;
    /// Number of queries or rounds before a warning is logged and the interval grows.
    const PATIENCE: u32 = 10;
    /// Interval of queries or rounds after that.
    const SLOW: Duration = Duration::from_secs(5);

    /// An idle release. `halt` stops the component; `None` if it is no driver.
    pub(super) const fn new(own: RaId, ra: RaId, halt: Option<Halt>) -> Self {
        Self {
            own,
            ra,
            halt,
            state: State::Done,
            reclaims: false,
            reports_control: false,
            commands: Vec::new(),
        }
    }

    /// Determines whether the component is held in our id, and stops and releases it if so. A
    /// component that is no driver is released without a query.
    pub(super) fn reclaim(&mut self, now: Instant) {
        if self.halt.is_none() {
            return self.begin(now, Standby::Spare);
        }
        self.reclaims = true;
        self.state = State::Asking {
            next: now,
            asked: 0,
        };
        self.handle_timeout(now);
    }

    /// Stops and releases the component.
    pub(super) fn begin(&mut self, now: Instant, standby: Standby) {
        self.state = State::Releasing {
            next: now,
            rounds: 0,
            standby,
        };
        self.handle_timeout(now);
    }

    /// Cancels the release: a client requests control of a component that is being released for
    /// another one, and has been stopped already.
    pub(super) const fn cancel(&mut self) {
        self.state = State::Done;
    }

    /// Whether the component is being reclaimed: no client may have control yet.
    pub(super) const fn is_reclaiming(&self) -> bool {
        self.reclaims
    }

    /// Whether no rounds are left.
    pub(super) fn is_done(&self) -> bool {
        self.state == State::Done
    }

    /// Handles a report of the component's controller.
    pub(super) fn handle_report(&mut self, now: Instant, controller: RaId) {
        self.reports_control = true;
        match self.state {
            State::Asking { .. } if controller == self.own => {
                tracing::info!(component = %self.ra, "was controlled under the gateway's id: \
                    stopped and released");
                self.begin(now, Standby::Send);
            }
            State::Asking { .. } | State::Releasing { .. } if controller != self.own => self.end(),
            _ => {}
        }
    }

    /// Handles a grant of control (0) or a refusal with its code. Returns whether it answers a
    /// request of the release.
    pub(super) fn handle_confirm(&mut self, now: Instant, code: u8) -> bool {
        match (self.state, code) {
            // It may have been free before.
            (State::Asking { .. }, 0) => self.begin(now, Standby::Spare),
            (State::Asking { .. }, _) => self.end(),
            (State::Releasing { .. }, _) => {}
            (State::Done, _) => return false,
        }
        true
    }

    /// Handles a rejection: we do not have control.
    pub(super) fn handle_reject(&mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.state = State::Done;
        self.reclaims = false;
    }

    /// Sends the next query or round, if it is due.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        match self.state {
            State::Asking { next, asked } if next <= now => self.ask(now, asked),
            State::Releasing {
                next,
                rounds,
                standby,
            } if next <= now => self.release(now, rounds, standby),
            _ => {}
        }
    }

    fn ask(&mut self, now: Instant, asked: u32) {
        let question = match asked {
            ..Self::QUERIES => (QUERY_CONTROL, Bytes::new()),
            _ => (REQUEST_CONTROL, Bytes::from_static(&[0])),
        };
        self.commands.push(question);
        self.state = State::Asking {
            next: now + self.interval(asked, "does not report its controller, and is not offered"),
            asked: asked.saturating_add(1),
        };
    }

    fn release(&mut self, now: Instant, rounds: u32, standby: Standby) {
        if rounds >= Self::ROUNDS && !self.reports_control {
            return self.end();
        }
        self.round(standby);
        self.state = State::Releasing {
            next: now + self.interval(rounds, "is still controlled under the gateway's id"),
            rounds: rounds.saturating_add(1),
            standby,
        };
    }

    /// The interval to the next query or round; logs `why` it grows.
    fn interval(&self, made: u32, why: &str) -> Duration {
        if made == Self::PATIENCE {
            tracing::warn!(component = %self.ra, "the RA component {why}");
        }
        match made {
            ..Self::PATIENCE => Self::INTERVAL,
            _ => Self::SLOW,
        }
    }

    /// Stops and releases the component once.
    pub(super) fn round(&mut self, standby: Standby) {
        if let Some(halt) = &self.halt {
            self.commands.extend(halt.command.clone());
            if standby == Standby::Send || halt.command.is_none() {
                self.commands.push((STANDBY, Bytes::new()));
            }
        }
        self.commands.push((RELEASE_CONTROL, Bytes::new()));
        self.commands.push((QUERY_CONTROL, Bytes::new()));
    }

    /// Takes the queued messages to the RA component.
    pub(super) fn take_commands(&mut self) -> Vec<Command> {
        std::mem::take(&mut self.commands)
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        match self.state {
            State::Done => None,
            State::Asking { next, .. } | State::Releasing { next, .. } => Some(next),
        }
    }
}
