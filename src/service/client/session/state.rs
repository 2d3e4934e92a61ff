//! The progress of a session, and why it has no control.

use std::fmt;

use super::super::news::{ControlLost, ControlRefused};
use crate::address::JausId;
use crate::service::State;

/// The progress of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionState {
    /// It looks for a member of its audience.
    Seeking,
    /// It asks this peer for control, or why it does not have it.
    Requesting(JausId),
    /// This peer is under control, and is being brought into the target state.
    Preparing(JausId),
    /// This peer obeys commands.
    Ready(JausId),
    /// This peer is under control and stands by, because the application wants that or has to
    /// decide anew after an emergency or a loss.
    Standby(JausId),
    /// The peer is under control, but in an emergency, failed or shut down.
    Disabled {
        /// The peer.
        peer: JausId,
        /// The code of its state in Report Status.
        state: u8,
    },
    /// The peer is not under control at present.
    Lost {
        /// The peer.
        peer: JausId,
        /// The reason.
        why: SessionLoss,
        /// Whether the session goes on by itself. Otherwise the application must ask for that.
        continues: bool,
    },
    /// The session was released.
    Released,
}

impl SessionState {
    /// The peer under control, if any.
    #[must_use]
    pub const fn held(self) -> Option<JausId> {
        match self {
            Self::Preparing(peer) | Self::Ready(peer) | Self::Standby(peer) => Some(peer),
            Self::Disabled { peer, .. } => Some(peer),
            Self::Seeking | Self::Requesting(_) | Self::Lost { .. } | Self::Released => None,
        }
    }
}

impl fmt::Display for SessionState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Seeking => write!(f, "no suitable component is known yet"),
            Self::Requesting(peer) => write!(f, "control of {peer} is requested"),
            Self::Preparing(peer) => write!(f, "{peer} is under control, but not prepared yet"),
            Self::Ready(peer) => write!(f, "{peer} is ready"),
            Self::Standby(peer) => write!(f, "{peer} is under control and stands by"),
            Self::Disabled { peer, state } => write!(f, "{peer} reports {}", in_words(*state)),
            Self::Lost { peer, why, .. } => write!(f, "no control of {peer}: {why}"),
            Self::Released => write!(f, "the session is over"),
        }
    }
}

/// Why a session has no control of its peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionLoss {
    /// Control was not granted.
    #[error("control was not granted: {0}")]
    Refused(ControlRefused),
    /// Control was lost.
    #[error("control was lost: {0}")]
    Control(ControlLost),
    /// The peer ended control, although no other client has it: it was late, or reset.
    #[error("it ended control without another client: a renewal was late, or it was reset")]
    Dropped,
    /// Another client has control.
    #[error("{0} is in control of it")]
    Taken(JausId),
    /// The peer reports a state in which it accepts no control, by its code in Report Status.
    #[error("it reports {}", in_words(*.0))]
    State(u8),
    /// The peer left the directory, or no longer offers the service.
    #[error("it left the network, or no longer offers the service")]
    Gone,
}

impl SessionLoss {
    /// Whether nobody is known to have caused it on purpose. A peer that ends also takes control
    /// back; if it was for another client, the peer says so before it is asked for control again.
    #[must_use]
    pub const fn is_technical(self) -> bool {
        match self {
            Self::Control(why) => {
                !matches!(why, ControlLost::Outranked | ControlLost::NotAvailable)
            }
            Self::Refused(why) => {
                matches!(why, ControlRefused::NoAnswer(_) | ControlRefused::Already)
            }
            Self::Dropped | Self::Gone => true,
            Self::Taken(_) => false,
            // Only the client in control can shut a component down, but its program may end.
            Self::State(code) => code == State::Failure as u8 || code == State::Shutdown as u8,
        }
    }

    /// Whether the peer has restarted.
    #[must_use]
    pub const fn is_restart(self) -> bool {
        matches!(self, Self::Control(ControlLost::Restarted))
    }

    /// Whether another client has control.
    #[must_use]
    pub const fn is_opposition(self) -> bool {
        match self {
            Self::Control(why) => matches!(why, ControlLost::Outranked),
            Self::Refused(why) => matches!(why, ControlRefused::InsufficientAuthority(_)),
            Self::Taken(_) => true,
            Self::Dropped | Self::Gone | Self::State(_) => false,
        }
    }
}

fn in_words(code: u8) -> String {
    let known = State::from_code(code).map(|state| state.to_string());
    known.unwrap_or_else(|| format!("the unknown state {code}"))
}
