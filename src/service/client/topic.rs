//! The topic of a subscription: peer, report and rate, and the check that the wire can carry it.

use bytes::Bytes;

use crate::address::JausId;
use crate::codec::{EncodeError, Message};
use crate::messages::core::CreateEvent;
use crate::messages::core::create_event::EventType;

/// When the peer sends a subscribed report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// Periodically, whether or not anything has changed.
    Periodic {
        /// The requested rate in hertz, above 0 and up to 1092.
        hz: f64,
        /// The lowest useful rate in hertz. The subscription ends if the peer confirms less.
        least_hz: f64,
    },
    /// On every change.
    OnChange,
}

impl When {
    /// At a rate in hertz, or the lower rate that the peer confirms.
    #[must_use]
    pub const fn hz(hz: f64) -> Self {
        Self::Periodic { hz, least_hz: 0.0 }
    }

    /// Ends the subscription if the peer confirms less than `least_hz`.
    #[must_use]
    pub const fn at_least(self, least_hz: f64) -> Self {
        match self {
            Self::Periodic { hz, .. } => Self::Periodic { hz, least_hz },
            Self::OnChange => self,
        }
    }
}

/// What a subscription is for.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// The component that sends the reports.
    pub peer: JausId,
    /// The query whose answer is the report, starting with its message code.
    pub query: Bytes,
    /// The message code of the report.
    pub report: u16,
    /// How often.
    pub when: When,
}

impl Topic {
    /// Checks that the wire can carry this request.
    ///
    /// # Errors
    /// The reason if it cannot, as from [`Stack::subscribe`](crate::service::Stack::subscribe).
    pub fn check(&self) -> Result<(), CannotSubscribe> {
        self.create_event(0)?.encode()?;
        Ok(())
    }

    /// The Create Event message for it.
    pub(super) fn create_event(&self, request: u8) -> Result<CreateEvent, CannotSubscribe> {
        let mut create = CreateEvent {
            request_id: request,
            event_type: EventType::EVERY_CHANGE,
            query_message: self.query.clone(),
            ..CreateEvent::default()
        };
        if let When::Periodic { hz, .. } = self.when {
            create.event_type = EventType::PERIODIC_SC;
            let set = create.set_requested_periodic_rate_hz(hz);
            // A rate that rounds to 0 is no rate.
            if set.is_err() || create.requested_periodic_rate == Default::default() {
                return Err(CannotSubscribe::Rate { hz });
            }
        }
        Ok(create)
    }
}

/// Why a subscription cannot even be requested.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CannotSubscribe {
    /// A subscription is to exactly one component.
    #[error("{0} is not a single component: subscribe to one")]
    NotOneComponent(JausId),
    /// The wire carries rates up to 1092 Hz in steps of 1/60 Hz.
    #[error("{hz} Hz is out of range: choose from 1/60 to 1092 Hz")]
    Rate {
        /// The requested rate in hertz.
        hz: f64,
    },
    /// The wire cannot carry the query.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The peer would treat both as one event.
    #[error("this component is already subscribed: use that subscription, or drop it first")]
    Already,
    /// The limit of subscriptions is reached.
    #[error("the limit of {0} subscriptions is reached: drop some")]
    TooMany(usize),
}
