//! What a subscription is for: whose report, how often, and whether that can be asked for at all.

use bytes::Bytes;

use crate::address::JausId;
use crate::codec::{EncodeError, Message};
use crate::messages::core::CreateEvent;
use crate::messages::core::create_event::EventType;

/// When a subscribed report is to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// Again and again, whether or not anything has changed.
    Periodic {
        /// The wanted rate in hertz, above 0 and up to 1092.
        hz: f64,
        /// The least rate in hertz that is of use; a peer that cannot keep it is refused.
        least_hz: f64,
    },
    /// Whenever it has changed.
    OnChange,
}

impl When {
    /// At a rate in hertz, or whatever lower rate the peer can keep.
    #[must_use]
    pub const fn hz(hz: f64) -> Self {
        Self::Periodic { hz, least_hz: 0.0 }
    }

    /// Refuses a peer that cannot keep `least_hz`.
    #[must_use]
    pub const fn at_least(self, least_hz: f64) -> Self {
        match self {
            Self::Periodic { hz, .. } => Self::Periodic { hz, least_hz },
            Self::OnChange => self,
        }
    }
}

/// What is subscribed to.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// Whose reports.
    pub peer: JausId,
    /// The query from its message code on, whose answer the report is.
    pub query: Bytes,
    /// The message code of the report.
    pub report: u16,
    /// How often.
    pub when: When,
}

impl Topic {
    /// Whether the wire can carry what is asked for.
    ///
    /// # Errors
    /// What can not be, as [`Stack::subscribe`](crate::service::Stack::subscribe) would say.
    pub fn check(&self) -> Result<(), CannotSubscribe> {
        self.create_event(0)?.encode()?;
        Ok(())
    }

    /// The request that is sent for it.
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
            // What is rounded to 0 would be no rate.
            if set.is_err() || create.requested_periodic_rate == Default::default() {
                return Err(CannotSubscribe::Rate { hz });
            }
        }
        Ok(create)
    }
}

/// Why a subscription cannot even be tried.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CannotSubscribe {
    /// Only one component can be subscribed to at a time.
    #[error("{0} is not one component, and an event is one component's")]
    NotOneComponent(JausId),
    /// The wire carries rates up to 1092 Hz in steps of 1/60 Hz.
    #[error("{hz} Hz cannot be asked for: a rate is from 1/60 to 1092 Hz")]
    Rate {
        /// The wanted rate in hertz.
        hz: f64,
    },
    /// The wire cannot carry the query.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The peer would take both for one event.
    #[error("this component subscribes to it already: use that subscription, or drop it first")]
    Already,
    /// There is no room.
    #[error("there are {0} subscriptions already, and no more are possible: drop some")]
    TooMany(usize),
}
