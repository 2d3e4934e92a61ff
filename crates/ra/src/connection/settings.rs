//! The settings of service connections.

use std::time::Duration;

/// The settings of [`Connections`](super::Connections).
#[derive(Clone, Debug)]
pub struct Settings {
    /// The most connections of others to our reports.
    pub max_provided: usize,
    /// The most connections of ours to the reports of others.
    pub max_wanted: usize,
    /// The highest rate of our reports, in hertz; who wants more is confirmed this one.
    pub max_rate: f64,
    /// How long to wait for a confirmation before a connection is asked for again.
    pub patience: Duration,
    /// How often it is asked for at this pace; afterwards each [`retry`](Self::retry).
    pub tries: u32,
    /// How often it is asked for then.
    pub retry: Duration,
    /// How long a provider may be silent at least, whatever the rate.
    pub silence: Duration,
    /// The most messages that wait to be sent, and the most reports that wait for the owner.
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
