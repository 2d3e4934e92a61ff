//! What can go wrong for an application, in sentences that say who did not do what.

use std::time::Duration;

use crate::address::JausId;
use crate::codec::{DecodeError, EncodeError};
use crate::node;
use crate::service::NoAnswer;

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

/// Why no component with a service was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FindError {
    /// None turned up in time.
    #[error(
        "no component that offers {service} was found within {:.1} s ({others} other components are known)",
        waited.as_secs_f64()
    )]
    NotFound {
        /// The URN that was looked for.
        service: String,
        /// For how long.
        waited: Duration,
        /// How many components are known at all, without the one that looked.
        others: usize,
    },
    /// The component has stopped, because its node has.
    #[error("the component has stopped with its node and finds nobody any more")]
    Stopped,
}
