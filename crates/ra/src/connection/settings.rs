//! Settings of service connections.

use std::time::Duration;

/// The settings of [`Connections`](super::Connections).
#[derive(Clone, Debug)]
pub struct Settings {
    /// Maximum number of remote connections to our reports.
    pub max_provided: usize,
    /// Maximum number of our connections to remote reports.
    pub max_wanted: usize,
    /// Maximum rate of our reports, in hertz; higher requests are confirmed at this rate.
    pub max_rate: f64,
    /// Timeout of a confirmation before the request is repeated.
    pub patience: Duration,
    /// Number of requests at this interval; later ones follow every [`retry`](Self::retry).
    pub tries: u32,
    /// Interval of later requests.
    pub retry: Duration,
    /// Minimum silence timeout of a provider, whatever the rate.
    pub silence: Duration,
    /// Maximum number of queued messages, and of reports queued for the owner.
    pub queue_limit: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_provided: 1024,
            max_wanted: 1024,
            max_rate: 100.0,
            patience: Duration::from_secs(1),
            tries: 3,
            retry: Duration::from_secs(5),
            silence: Duration::from_secs(2),
            queue_limit: 4096,
        }
    }
}
