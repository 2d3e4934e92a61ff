//! A peer under control: its state, and the commands that bring it into the target state.

use std::time::{Duration, Instant};

use super::super::control::ControlId;
use super::{SessionState, TargetState};
use crate::address::JausId;
use crate::messages::core::{Resume, Standby};
use crate::service::{Outbox, State};
use crate::wire::Priority;

/// A peer under control.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    pub(super) peer: JausId,
    pub(super) control: ControlId,
    pub(super) since: Instant,
    /// Whether it has states. Otherwise it obeys commands as soon as it is under control, and only
    /// the session can stand by.
    pub(super) is_managed: bool,
    pub(super) status: Option<u8>,
    /// When to send Resume or Standby, if the status is not as wanted.
    pub(super) due: Instant,
}

/// A state command.
#[derive(Debug, Clone, Copy)]
enum Command {
    Resume,
    Standby,
}

impl Held {
    /// Interval of Resume and Standby until the peer reports that state. A large machine takes a
    /// moment to change it.
    const REPEAT: Duration = Duration::from_millis(500);

    pub(super) fn is_in_emergency(&self) -> bool {
        self.status == Some(State::Emergency as u8)
    }

    pub(super) fn state(&self, target: TargetState) -> SessionState {
        let peer = self.peer;
        if !self.is_managed {
            return match target {
                TargetState::Ready | TargetState::AsFound => SessionState::Ready(peer),
                TargetState::Standby => SessionState::Standby(peer),
            };
        }
        let Some(state) = self.status else {
            return SessionState::Preparing(peer);
        };
        match (State::from_code(state), target) {
            (Some(State::Ready), TargetState::Ready | TargetState::AsFound) => {
                SessionState::Ready(peer)
            }
            (Some(State::Standby), TargetState::Standby | TargetState::AsFound) => {
                SessionState::Standby(peer)
            }
            (Some(State::Initialize | State::Ready | State::Standby), _) => {
                SessionState::Preparing(peer)
            }
            _ => SessionState::Disabled { peer, state },
        }
    }

    /// The state command that the peer needs.
    fn command(&self, target: TargetState) -> Option<Command> {
        if !self.is_managed {
            return None;
        }
        match (self.status.map(State::from_code), target) {
            (None | Some(Some(State::Initialize | State::Standby)), TargetState::Ready) => {
                Some(Command::Resume)
            }
            (None | Some(Some(State::Ready)), TargetState::Standby) => Some(Command::Standby),
            _ => None,
        }
    }

    /// When the next state command is due.
    pub(super) fn poll_timeout(&self, target: TargetState) -> Option<Instant> {
        self.command(target).map(|_| self.due)
    }

    /// Sends the state command that is due.
    pub(super) fn manage(&mut self, now: Instant, target: TargetState, out: &mut Outbox) {
        if self.due > now {
            return;
        }
        match self.command(target) {
            Some(Command::Resume) => out.send_with(self.peer, Priority::High, &Resume {}),
            Some(Command::Standby) => out.send_with(self.peer, Priority::High, &Standby {}),
            None => return,
        }
        self.due = now + Self::REPEAT;
    }
}
