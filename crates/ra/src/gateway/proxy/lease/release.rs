//! Release of an RA component: it is stopped first, then released, until it is known to be free.
//!
//! RA components keep their last command: OpenJAUS's primitive driver drives on with the last effort
//! as soon as its controller reports ready, its waypoint driver with the last speed. A gateway that
//! was killed therefore leaves components behind that obey its successor, which has the same id. So
//! each driver is reclaimed when it appears, before any JAUS client gets control of it:
//!
//! 1. Query Component Control asks who controls it.
//! 2. OpenJAUS does not answer that. Request Component Control with authority 0 then takes control
//!    from nobody: another controller makes the component reject it, a free component and one that is
//!    held in our id confirm it.
//! 3. A component that is held in our id is stopped and released. The rounds are repeated until Report
//!    Component Control names another controller or none; a component that does not report it gets
//!    [`ROUNDS`](Release::ROUNDS) of them.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::super::codes::{QUERY_CONTROL, RELEASE_CONTROL, REQUEST_CONTROL, STANDBY};
use crate::RaId;

/// Code and data of a message for the RA component.
type Command = (u16, Bytes);

/// How an RA driver is stopped.
#[derive(Debug, Clone, Default)]
pub(in crate::gateway::proxy) struct Halt {
    /// The command that stops it, if there is one that says nothing besides. Standby does without.
    pub(in crate::gateway::proxy) command: Option<(u16, Bytes)>,
}

/// Stops and releases one RA component.
#[derive(Debug)]
pub(super) struct Release {
    /// The gateway among RA systems.
    own: RaId,
    ra: RaId,
    halt: Option<Halt>,
    state: State,
    /// Whether no client may have control before this is done.
    reclaims: bool,
    /// Whether it reports who controls it.
    reports_control: bool,
    commands: Vec<Command>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Done,
    /// The component is asked who controls it.
    Asking {
        next: Instant,
        asked: u32,
    },
    /// It is stopped and released.
    Releasing {
        next: Instant,
        rounds: u32,
        standby: Standby,
    },
}

/// Whether a driver is also sent to Standby.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standby {
    /// It was held by us.
    Send,
    /// It may have been free, and may be wanted ready by others: only if nothing else stops it.
    Spare,
}

impl Release {
    /// Between two questions or rounds.
    const INTERVAL: Duration = Duration::from_millis(300);
    /// Query Component Control is sent so often before Request Component Control.
    const QUERIES: u32 = 2;
    /// Rounds for a component that does not report who controls it.
    const ROUNDS: u32 = 3;
    /// After so many questions or rounds a warning is logged, and they become rare.
    const PATIENCE: u32 = 10;
    /// Between two questions or rounds after that.
    const SLOW: Duration = Duration::from_secs(5);

    /// Nothing to do yet. `halt` stops the component; without it, it drives nothing.
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

    /// Finds out whether the component is held in our id, and stops and releases it if so. One that
    /// drives nothing is released without a question.
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

    /// A client asks for control of a component that is being released for another one: it has been
    /// stopped already.
    pub(super) const fn cancel(&mut self) {
        self.state = State::Done;
    }

    /// Whether the component is being reclaimed: no client may have it yet.
    pub(super) const fn is_reclaiming(&self) -> bool {
        self.reclaims
    }

    /// Whether rounds are still to come.
    pub(super) fn is_done(&self) -> bool {
        self.state == State::Done
    }

    /// The component has reported who controls it.
    pub(super) fn handle_report(&mut self, now: Instant, controller: RaId) {
        self.reports_control = true;
        match self.state {
            State::Asking { .. } if controller == self.own => {
                tracing::info!(component = %self.ra, "held in the gateway's id: stopped and released");
                self.begin(now, Standby::Send);
            }
            State::Asking { .. } | State::Releasing { .. } if controller != self.own => self.end(),
            _ => {}
        }
    }

    /// The component has granted control to us (0), or has refused with a code. Says whether that was
    /// the answer to a question of the release.
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

    /// The component has refused control or taken it back: we do not hold it.
    pub(super) fn handle_reject(&mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.state = State::Done;
        self.reclaims = false;
    }

    /// Sends the next question or round, if it is due.
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
            next: now + self.interval(asked, "does not say who controls it, and is not offered"),
            asked: asked.saturating_add(1),
        };
    }

    fn release(&mut self, now: Instant, rounds: u32, standby: Standby) {
        if rounds >= Self::ROUNDS && !self.reports_control {
            return self.end();
        }
        self.round(standby);
        self.state = State::Releasing {
            next: now + self.interval(rounds, "is still held in the gateway's id"),
            rounds: rounds.saturating_add(1),
            standby,
        };
    }

    /// The time until the next question or round; logs `why` it becomes longer.
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

    /// Messages for the RA component.
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
