//! Notifications about subscriptions and control.

use std::fmt;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::Rejection;
use crate::service::NoAnswer;

/// A notification about a subscription.
#[derive(Debug, Clone, PartialEq)]
pub enum SubscriptionNews {
    /// The peer has confirmed the event: for the first time, after an outage, or at another rate.
    Up {
        /// The confirmed rate in hertz; `None` for reports on change.
        hz: Option<f64>,
    },
    /// A report has arrived.
    Report {
        /// The report, starting with its message code.
        report: Bytes,
        /// The number of reports lost just before this one.
        lost: u8,
    },
    /// No reports arrive at present; the event is being created again.
    Down {
        /// Time of the last sign of the event.
        since: Instant,
        /// The cause.
        why: Outage,
    },
    /// It is over; no more reports will arrive.
    Ended(SubscriptionEnd),
}

/// Why a subscription is down.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outage {
    /// No report has arrived for four periods and at least half a second.
    Silent,
    /// The peer does not confirm that the event still exists.
    Unconfirmed,
    /// Discovery has lost the peer.
    PeerLost,
    /// The peer no longer knows the event, and refuses to create it again.
    Refused(Rejection),
}

impl fmt::Display for Outage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent => f.write_str("the reports have stopped"),
            Self::Unconfirmed => f.write_str("the peer no longer confirms the event"),
            Self::PeerLost => f.write_str("the peer is lost"),
            Self::Refused(reason) => write!(f, "the peer refuses the event: {reason}"),
        }
    }
}

/// Why a subscription has ended or was never established.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubscriptionEnd {
    /// The peer refused the event.
    #[error("the peer refuses it: {0}")]
    Rejected(Rejection),
    /// The peer neither confirmed nor refused it.
    #[error(
        "CreateEvent was answered with neither ConfirmEventRequest nor RejectEventRequest: {} \
         attempts in {:.1} s",
        .0.tries, .0.waited.as_secs_f64()
    )]
    NoAnswer(NoAnswer),
    /// The peer confirmed a lower rate than required.
    #[error("the peer confirmed only {hz:.2} Hz, but at least {least_hz:.2} Hz are required")]
    TooSlow {
        /// The confirmed rate in hertz.
        hz: f64,
        /// The required rate in hertz.
        least_hz: f64,
    },
}

/// The progress of a request for control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlNews {
    /// The peer has granted it.
    Granted,
    /// The peer has not granted it, and the request is over.
    Refused(ControlRefused),
    /// The peer, under control, has reported a different status than before, by its code in Report
    /// Status.
    Status(u8),
    /// It was granted and is lost for good: it is not requested again automatically.
    Lost(ControlLost),
    /// It was released: the peer has confirmed the release, or its control has timed out since, or
    /// control of the peer was requested again.
    Released,
}

/// Why control was not granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlRefused {
    /// Confirm Control with NOT_AVAILABLE.
    #[error("it refuses control, for example because of an emergency")]
    NotAvailable,
    /// Confirm Control with INSUFFICIENT_AUTHORITY.
    #[error("the authority {0} is below its minimum, or not above that of the client in control")]
    InsufficientAuthority(u8),
    /// Confirm Control with an undefined code.
    #[error("it answered ConfirmControl with the undefined code {0}")]
    Code(u8),
    /// The peer has not answered.
    #[error(
        "it did not answer RequestControl with ConfirmControl: {} attempts in {:.1} s",
        .0.tries, .0.waited.as_secs_f64()
    )]
    NoAnswer(NoAnswer),
    /// The application already controls this peer.
    #[error("this component already controls it or has requested control")]
    Already,
    /// The id has a wildcard or a zero.
    #[error("it is not a single component")]
    NotOneComponent,
}

/// Why control was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlLost {
    /// Reject Control with CONTROL_RELEASED: a client with a greater authority has it, or the peer
    /// has reset it or timed it out.
    #[error("the peer rejected control, for another client or because renewal was late")]
    TakenBack,
    /// The peer has become unavailable, for instance because of an emergency.
    #[error("the peer no longer accepts control, for example because of an emergency")]
    NotAvailable,
    /// Another client with a greater authority has it: the renewal was refused.
    #[error("another client with a higher authority has control")]
    Outranked,
    /// The peer has restarted and lost the control.
    #[error("the peer restarted, or dropped control without notice")]
    Restarted,
    /// The peer has not confirmed it within its lifetime.
    #[error("the peer has not confirmed control for {:.1} s", .0.as_secs_f64())]
    Silent(Duration),
}

impl ControlNews {
    pub(super) const fn is_final(self) -> bool {
        matches!(self, Self::Refused(_) | Self::Released)
    }
}
