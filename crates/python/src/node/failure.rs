//! Errors of calls: the name of a class of `jaus.errors`, and a text that says what to do.

use std::error::Error;

use jaus::component::{
    AttachError, ControlError, DeliverError, FindError, ManageError, QueryError, SendError,
    SubscribeError,
};
use jaus::service::UnsafeService;
use jaus_binding::{NotStarted, with_sources};
use pyo3::PyErr;
use pyo3::prelude::*;

/// Why a call fails.
#[derive(Debug, Clone)]
pub(crate) struct Failure {
    class: &'static str,
    text: String,
}

impl Failure {
    pub(crate) fn new(class: &'static str, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { class, text }
    }

    pub(crate) fn of(class: &'static str, error: &dyn Error) -> Self {
        Self::new(class, with_sources(error))
    }

    pub(crate) fn argument(text: impl Into<String>) -> Self {
        Self::new("ArgumentError", text)
    }

    pub(crate) fn closed(what: &str) -> Self {
        Self::new(
            "ClosedError",
            format!("the {what} is closed: create a new one"),
        )
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn forked(what: &str) -> Self {
        let text = format!("the {what} belongs to the parent process: create one in this process");
        Self::new("ForkError", text)
    }

    /// The exception of the package.
    pub(crate) fn exception<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = py.import("jaus.errors")?.getattr(self.class)?;
        class.call1((&self.text,))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        Python::attach(|py| match failure.exception(py) {
            Ok(exception) => Self::from_value(exception),
            Err(error) => error,
        })
    }
}

impl From<&QueryError> for Failure {
    fn from(error: &QueryError) -> Self {
        let class = match error {
            QueryError::NoAnswer { .. } => "NoAnswerError",
            QueryError::NotOffered { .. } => "NotFoundError",
            QueryError::Stopped => "ClosedError",
            _ => "SendError",
        };
        Self::of(class, error)
    }
}

impl From<&SendError> for Failure {
    fn from(error: &SendError) -> Self {
        Self::of("SendError", error)
    }
}

impl From<&DeliverError> for Failure {
    fn from(error: &DeliverError) -> Self {
        Self::of("SendError", error)
    }
}

impl From<&FindError> for Failure {
    fn from(error: &FindError) -> Self {
        let class = match error {
            FindError::Stopped => "ClosedError",
            _ => "NotFoundError",
        };
        Self::of(class, error)
    }
}

impl From<&ControlError> for Failure {
    fn from(error: &ControlError) -> Self {
        let class = match error {
            ControlError::Refused { .. } => "RefusedError",
            ControlError::Lost { .. } => "ControlLostError",
            ControlError::NotReady { .. } => "NotReadyError",
            ControlError::Stopped => "ClosedError",
            _ => "SendError",
        };
        Self::of(class, error)
    }
}

impl From<&ManageError> for Failure {
    fn from(error: &ManageError) -> Self {
        match error {
            ManageError::State { .. } => Self::of("RefusedError", error),
            ManageError::Control(control) => control.into(),
            ManageError::Query(query) => query.into(),
            _ => Self::of("SendError", error),
        }
    }
}

impl From<&SubscribeError> for Failure {
    fn from(error: &SubscribeError) -> Self {
        let class = match error {
            SubscribeError::Impossible { .. } => "ArgumentError",
            SubscribeError::Ended { .. } => "RefusedError",
            SubscribeError::Stopped => "ClosedError",
            _ => "SendError",
        };
        Self::of(class, error)
    }
}

impl From<&NotStarted> for Failure {
    /// In the words of this interface.
    fn from(error: &NotStarted) -> Self {
        let NotStarted::Attach(AttachError::Unsafe(unsafe_service)) = error else {
            return Self::of("StartError", error);
        };
        let text = match unsafe_service {
            UnsafeService::NoManagement { service, command } => format!(
                "{service} acts on {command}, but without Management the component would obey any \
                 client: create the component with management=True"
            ),
            UnsafeService::NoStop { service, command } => format!(
                "{service} acts on {command}, but nothing stops it: register a function with on_stop"
            ),
            UnsafeService::NoAccessControl { service, command } => format!(
                "{command} configures {service}, but without Access Control the component would \
                 obey any client: create the component with access_control=True or management=True"
            ),
            UnsafeService::QueryNotAnswered { service, query } => format!(
                "{service} is offered, but nothing answers {query}: call publishes, answers or \
                 declines for it"
            ),
            other => other.to_string(),
        };
        Self::new("UnsafeServiceError", text)
    }
}
