//! The definition of a report that the bridge publishes without knowing it.

use std::fmt;
use std::sync::Arc;

use jsidl::model::{Id, Message};

/// The definition of a report.
#[derive(Clone)]
pub struct Definition {
    /// The service that declares it.
    pub service: Id,
    /// The report.
    pub message: Arc<Message>,
}

impl fmt::Debug for Definition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.message.name, self.service)
    }
}

impl PartialEq for Definition {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Definition {}

impl PartialOrd for Definition {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Definition {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

impl Definition {
    /// A service has one message of a code.
    fn key(&self) -> (&Id, u16) {
        (&self.service, self.message.code)
    }
}
