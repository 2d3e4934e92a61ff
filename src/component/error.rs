//! The errors of the application interface; each names the peer and the failed operation.

use std::fmt;
use std::time::Duration;

use crate::address::JausId;
use crate::codec::{DecodeError, EncodeError, OutOfRange};
use crate::node;
use crate::service::{
    CannotSubscribe, ControlLost, ControlRefused, NoAnswer, NotPublished, Offer, SessionState,
    State, SubscriptionEnd, UnsafeService,
};

/// Why a message was not sent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The wire cannot carry it.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The node rejected it.
    #[error(transparent)]
    Node(#[from] node::SendError),
}

/// The component has stopped; [`Component::stopped`](super::Component::stopped) says why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the component has stopped")]
pub struct Stopped;

/// Why a component has stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// Its node or its runtime was stopped.
    Ended,
    /// One of its services has panicked. What it moved was stopped, and its peers see it leave.
    Panicked,
}

/// Why a service is not offered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OfferError {
    /// The component lacks what makes it safe.
    #[error(transparent)]
    Unsafe(#[from] UnsafeService),
    /// The component has stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Why the delivery of a message is not confirmed.
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
    /// The query timed out.
    #[error(
        "{peer} did not answer {query} with {report}: {tries} attempts in {:.1} s",
        waited.as_secs_f64()
    )]
    NoAnswer {
        /// The queried component.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The name of the expected report.
        report: &'static str,
        /// How often the query was sent.
        tries: u32,
        /// How long the query waited.
        waited: Duration,
    },
    /// The peer offers none of the services that answer the query, so it was not sent.
    #[error("{peer} offers no service that answers {query}: {} does", services.join(" or "))]
    NotOffered {
        /// The component to query.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The services that answer the query.
        services: Vec<&'static str>,
    },
    /// The answer does not match its definition.
    #[error("{peer} answered {query}, but the answer cannot be decoded")]
    Unreadable {
        /// The component that answered.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// What is wrong with the answer.
        source: DecodeError,
    },
    /// The query could not be sent.
    #[error("cannot send {query} to {peer}")]
    NotSent {
        /// The component to query.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The reason.
        source: SendError,
    },
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and sends no more queries")]
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

/// Why a report was not published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PublishError {
    /// No service of the component publishes it.
    #[error(transparent)]
    NotPublished(#[from] NotPublished),
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and publishes no more reports")]
    Stopped,
}

/// Why there is no subscription.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubscribeError {
    /// No valid request for it can be made.
    #[error("cannot subscribe to {query} of {peer}: {why}")]
    Impossible {
        /// The component that would send the reports.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The reason.
        why: CannotSubscribe,
    },
    /// The peer did not confirm it.
    #[error("no subscription to {query} of {peer}: {why}")]
    Ended {
        /// The component that would send the reports.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The reason.
        why: SubscriptionEnd,
    },
    /// The request could not be sent.
    #[error("cannot send CreateEvent for {query} to {peer}")]
    NotSent {
        /// The component that would send the reports.
        peer: JausId,
        /// The name of the query.
        query: &'static str,
        /// The reason.
        source: SendError,
    },
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and accepts no more subscriptions")]
    Stopped,
}

/// Why a peer is not, or no longer, under control.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlError {
    /// It was not granted.
    #[error("no control of {peer}: {why}")]
    Refused {
        /// The component to control.
        peer: JausId,
        /// The reason.
        why: ControlRefused,
    },
    /// It was granted, and lost.
    #[error("control of {peer} is lost: {why}")]
    Lost {
        /// The component that was controlled.
        peer: JausId,
        /// The reason.
        why: ControlLost,
    },
    /// Control is held, but the peer does not act on commands: it was resumed, and is no longer
    /// ready.
    #[error(
        "{peer} is no longer ready: it reports the status {state}; call `resume`, unless it is in \
         an emergency or failed"
    )]
    NotReady {
        /// The controlled component.
        peer: JausId,
        /// The code of its state, as in Report Status.
        state: u8,
    },
    /// A message could not be sent.
    #[error(transparent)]
    NotSent(#[from] SendError),
    /// The delivery of a command is not confirmed.
    #[error(transparent)]
    Undelivered(#[from] DeliverError),
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and controls no more peers")]
    Stopped,
}

/// Why a session's peer does not obey commands at present.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The session is in another state than the operation needs.
    #[error("{0}")]
    State(SessionState),
    /// A message could not be sent.
    #[error(transparent)]
    NotSent(#[from] SendError),
    /// The delivery of a command is not confirmed.
    #[error(transparent)]
    Undelivered(#[from] DeliverError),
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and controls no more peers")]
    Stopped,
}

/// Why a request to change a list or to run a command has failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The wire cannot carry it.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// A value is outside the range of its field.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A list has no numbers for so many elements.
    #[error("a list has at most 65534 elements, not {0}")]
    TooManyElements(usize),
    /// The delivery is not confirmed.
    #[error(transparent)]
    Undelivered(#[from] DeliverError),
    /// A query has no answer.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// The peer does not confirm the request, or does not report the end of the command.
    #[error("{peer} has not answered {request} within {:.0} s", waited.as_secs_f64())]
    Unconfirmed {
        /// The peer.
        peer: JausId,
        /// The name of the message.
        request: &'static str,
        /// The time limit.
        waited: Duration,
    },
    /// The peer rejects the request.
    #[error("{peer} rejects {request}: {reason}")]
    Rejected {
        /// The peer.
        peer: JausId,
        /// The name of the message.
        request: &'static str,
        /// The peer's reason.
        reason: String,
    },
    /// The command has ended without success.
    #[error("{peer} could not complete {command}")]
    Unsuccessful {
        /// The peer.
        peer: JausId,
        /// The name of the command.
        command: &'static str,
    },
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and sends no more requests")]
    Stopped,
}

/// Why a peer is not known to be in the wanted state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ManageError {
    /// The command could not be sent.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The peer does not report its state.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// It is in another state.
    #[error("{peer} was set to the state {wanted}, but reports the status {found}")]
    State {
        /// The commanded component.
        peer: JausId,
        /// The wanted state.
        wanted: State,
        /// The status code that it reports instead.
        found: u8,
    },
}

/// Why no component with a service was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FindError {
    /// None was found in time.
    #[error(
        "no component with {service} found within {:.1} s ({})",
        waited.as_secs_f64(), Instead(*others, instead)
    )]
    NotFound {
        /// The wanted service: its URN, and the version if it matters.
        service: String,
        /// How long the search took.
        waited: Duration,
        /// The number of known components, without the searching one.
        others: usize,
        /// Components that offer the service in an unsuitable version.
        instead: Vec<(JausId, Offer)>,
    },
    /// The component has stopped, because its node has.
    #[error("the component stopped with its node and finds no more components")]
    Stopped,
}

/// What was found instead of the wanted service.
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
