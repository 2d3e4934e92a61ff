//! Notifications about a subscription.

use std::fmt;
use std::time::Instant;

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
