//! What can go wrong for an application, in sentences that say who did not do what.

use std::fmt;
use std::time::Duration;

use crate::address::JausId;
use crate::codec::{DecodeError, EncodeError};
use crate::node;
use crate::service::{
    CannotSubscribe, ControlLost, ControlRefused, NoAnswer, Offer, State, SubscriptionEnd,
};

/// Why a message was not sent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The wire cannot carry it.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The node would not take it.
    #[error(transparent)]
    Node(#[from] node::SendError),
}

/// Why it is not known that a message has arrived.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeliverError {
    /// The wire cannot carry it.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// It was not sent, or not acknowledged.
    #[error(transparent)]
    Undelivered(#[from] node::Undelivered),
}

/// Why a query has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QueryError {
    /// Nobody answered in time.
    #[error(
        "{peer} did not answer {query} with {report}: asked {tries} times in {:.1} s",
        waited.as_secs_f64()
    )]
    NoAnswer {
        /// Who was asked.
        peer: JausId,
        /// What was asked.
        query: &'static str,
        /// What was waited for.
        report: &'static str,
        /// How often it was asked.
        tries: u32,
        /// How long it was waited for.
        waited: Duration,
    },
    /// The answer is not what the definition says.
    #[error("{peer} answered {query}, but the answer cannot be read")]
    Unreadable {
        /// Who answered.
        peer: JausId,
        /// What was asked.
        query: &'static str,
        /// What is wrong with the answer.
        source: DecodeError,
    },
    /// The query could not be sent.
    #[error("{query} could not be sent to {peer}")]
    NotSent {
        /// Who was to be asked.
        peer: JausId,
        /// What was to be asked.
        query: &'static str,
        /// Why not.
        source: SendError,
    },
    /// The component has stopped, because its node has.
    #[error("the component has stopped with its node and asks nothing any more")]
    Stopped,
}

impl QueryError {
    pub(super) const fn no_answer(
        query: &'static str,
        report: &'static str,
        failure: &NoAnswer,
    ) -> Self {
        let NoAnswer {
            peer,
            tries,
            waited,
        } = *failure;
        Self::NoAnswer {
            peer,
            query,
            report,
            tries,
            waited,
        }
    }
}

/// Why there is no subscription.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubscribeError {
    /// It cannot even be asked for.
    #[error("no subscription to {query} of {peer} is possible: {why}")]
    Impossible {
        /// Whose reports were wanted.
        peer: JausId,
        /// What was to be answered again and again.
        query: &'static str,
        /// Why not.
        why: CannotSubscribe,
    },
    /// The peer did not confirm it.
    #[error("no subscription to {query} of {peer}: {why}")]
    Ended {
        /// Whose reports were wanted.
        peer: JausId,
        /// What was to be answered again and again.
        query: &'static str,
        /// Why not.
        why: SubscriptionEnd,
    },
    /// The request could not be sent.
    #[error("CreateEvent for {query} could not be sent to {peer}")]
    NotSent {
        /// Whose reports were wanted.
        peer: JausId,
        /// What was to be answered again and again.
        query: &'static str,
        /// Why not.
        source: SendError,
    },
    /// The component has stopped, because its node has.
    #[error("the component has stopped with its node and subscribes to nothing any more")]
    Stopped,
}

/// Why a peer is not, or not any more, under control.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlError {
    /// It was not granted.
    #[error("no control over {peer}: {why}")]
    Refused {
        /// Who was to be controlled.
        peer: JausId,
        /// Why not.
        why: ControlRefused,
    },
    /// It was granted, and lost.
    #[error("control over {peer} is lost: {why}")]
    Lost {
        /// Who was controlled.
        peer: JausId,
        /// What has happened.
        why: ControlLost,
    },
    /// Control is held, and the peer acts on no command: it was made ready, and is no longer.
    #[error(
        "{peer} is not ready any more: it reports the status {state}; `resume` makes it ready, \
         unless it is in an emergency or has failed"
    )]
    NotReady {
        /// Who is controlled.
        peer: JausId,
        /// The code of its state, as in Report Status.
        state: u8,
    },
    /// A message could not be sent.
    #[error(transparent)]
    NotSent(#[from] SendError),
    /// A command is not known to have arrived.
    #[error(transparent)]
    Undelivered(#[from] DeliverError),
    /// The component has stopped, because its node has.
    #[error("the component has stopped with its node and controls nothing any more")]
    Stopped,
}

/// Why a peer is not known to have the wanted state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ManageError {
    /// The command could not be given.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The peer does not say how it is.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// It has another state.
    #[error("{peer} was told to be in the state {wanted}, and reports the status {found}")]
    State {
        /// Who was told.
        peer: JausId,
        /// The state that was wanted.
        wanted: State,
        /// The status code that it reports instead.
        found: u8,
    },
}

/// Why no component with a service was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FindError {
    /// None turned up in time.
    #[error(
        "no component that offers {service} was found within {:.1} s ({})",
        waited.as_secs_f64(), Instead(*others, instead)
    )]
    NotFound {
        /// What was looked for: the URN, and the version if it matters.
        service: String,
        /// For how long.
        waited: Duration,
        /// How many components are known at all, without the one that looked.
        others: usize,
        /// Who offers the service in a version that will not do.
        instead: Vec<(JausId, Offer)>,
    },
    /// The component has stopped, because its node has.
    #[error("the component has stopped with its node and finds nobody any more")]
    Stopped,
}

/// What was found in place of what was looked for.
struct Instead<'a>(usize, &'a [(JausId, Offer)]);

impl fmt::Display for Instead<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(others, instead) = *self;
        if instead.is_empty() {
            return write!(f, "{others} other components are known");
        }
        for (place, (id, offer)) in instead.iter().enumerate() {
            let gap = if place == 0 { "" } else { ", " };
            write!(
                f,
                "{gap}{id} offers version {}.{}",
                offer.major, offer.minor
            )?;
        }
        Ok(())
    }
}
