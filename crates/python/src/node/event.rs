//! Events for the program, and how Python sees them: `(kind, subject, values)`.

use std::time::Instant;

use bytes::Bytes;
use jaus::address;
use jaus::node::now;
use jaus::service::StopCause;
use jaus_binding::{Loss, Notice, ServiceKey};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::failure::Failure;
use super::id::JausId;

/// An event. Subjects are the numbers of what it is about.
#[derive(Debug)]
pub(crate) enum Event {
    /// A message for a handler, with the number of stops of its component before it.
    Message {
        handler: u64,
        sender: address::JausId,
        message: Bytes,
        stops: u64,
    },
    /// What commands have started must stop, and the stop function is being called.
    Stopped {
        component: u64,
        cause: String,
    },
    Report {
        subscription: u64,
        message: Bytes,
        arrived: Instant,
        lost: u64,
    },
    Up {
        subscription: u64,
        rate: Option<f64>,
    },
    Down {
        subscription: u64,
        why: String,
    },
    /// With the reason, if the peer has ended it.
    Over {
        subscription: u64,
        why: Option<String>,
    },
    ControlStatus {
        control: u64,
        state: Option<u8>,
    },
    ControlLost {
        control: u64,
        failure: Failure,
    },
    Standing {
        component: u64,
        state: u8,
        controller: Option<address::JausId>,
    },
    /// A component is found, or lost.
    Discovery {
        component: u64,
        id: address::JausId,
        is_found: bool,
    },
    /// The end of a request.
    Done {
        request: u64,
        result: Result<Answer, Failure>,
    },
}

/// The result of a request.
#[derive(Debug)]
pub(crate) enum Answer {
    Nothing,
    Octets(Bytes),
    Id(address::JausId),
}

impl Notice for Event {
    fn stopped(service: ServiceKey, _: address::JausId, cause: Option<&StopCause>) -> Self {
        let cause = cause.map_or_else(
            || "the command was not repeated in time".to_owned(),
            ToString::to_string,
        );
        Self::Stopped {
            component: service.number(),
            cause,
        }
    }

    fn loss(&self) -> Loss {
        match self {
            Self::Report { .. } => Loss::First,
            Self::Done { .. } => Loss::Never,
            _ => Loss::Last,
        }
    }
}

impl Event {
    /// The event as `(kind, subject, values)`.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let octets = |message: &Bytes| PyBytes::new(py, message);
        match self {
            Self::Message {
                handler,
                sender,
                message,
                stops,
            } => (
                "message",
                handler,
                (octets(&message), JausId(sender), stops),
            )
                .into_py_any(py),
            Self::Stopped { component, cause } => ("stopped", component, (cause,)).into_py_any(py),
            Self::Report {
                subscription,
                message,
                arrived,
                lost,
            } => {
                let age = (now() - arrived).as_secs_f64();
                ("report", subscription, (octets(&message), age, lost)).into_py_any(py)
            }
            Self::Up { subscription, rate } => ("up", subscription, (rate,)).into_py_any(py),
            Self::Down { subscription, why } => ("down", subscription, (why,)).into_py_any(py),
            Self::Over { subscription, why } => ("over", subscription, (why,)).into_py_any(py),
            Self::ControlStatus { control, state } => ("status", control, (state,)).into_py_any(py),
            Self::ControlLost { control, failure } => {
                ("lost", control, (failure.exception(py)?,)).into_py_any(py)
            }
            Self::Standing {
                component,
                state,
                controller,
            } => ("standing", component, (state, controller.map(JausId))).into_py_any(py),
            Self::Discovery {
                component,
                id,
                is_found,
            } => ("discovery", component, (JausId(id), is_found)).into_py_any(py),
            Self::Done { request, result } => match result {
                Ok(answer) => ("done", request, (answer.into_python(py)?,)).into_py_any(py),
                Err(failure) => ("failed", request, (failure.exception(py)?,)).into_py_any(py),
            },
        }
    }
}

impl Answer {
    /// The result of a request that has no other answer than its success.
    pub(crate) fn nothing<E>(result: Result<(), E>) -> Result<Self, Failure>
    where
        for<'a> Failure: From<&'a E>,
    {
        match result {
            Ok(()) => Ok(Self::Nothing),
            Err(error) => Err((&error).into()),
        }
    }

    fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        match self {
            Self::Nothing => Ok(py.None()),
            Self::Octets(octets) => PyBytes::new(py, &octets).into_py_any(py),
            Self::Id(id) => JausId(id).into_py_any(py),
        }
    }
}
