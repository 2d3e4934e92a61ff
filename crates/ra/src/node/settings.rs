//! Settings of an RA node: timing and limits, with defaults that suit OpenJAUS.

use std::time::Duration;

use crate::carrier;
use jaus::endpoint::Rate;

/// The settings of an [`RaNode`](super::RaNode).
#[derive(Clone, Debug)]
pub struct Settings {
    /// Settings of the datagram layer.
    pub carrier: carrier::Settings,
    /// Heartbeat period of each local subsystem. OpenJAUS: 1 s.
    pub heartbeat: Duration,
    /// Silence after which a peer is lost. OpenJAUS: 5 s.
    pub silence: Duration,
    /// Timeout of a query before it is repeated.
    pub patience: Duration,
    /// Attempts of a query before it waits for the next [`refresh`](Self::refresh).
    pub tries: u32,
    /// Period of repeated configuration queries, for peers that do not report changes.
    pub refresh: Duration,
    /// Period of repeated queries for names and services of all components.
    pub review: Duration,
    /// How long changes of our configuration are collected before they are sent: OpenJAUS repeats
    /// all its queries for each change.
    pub gather: Duration,
    /// Rate limit of answers to one subsystem.
    pub answers: Rate,
    /// Rate limit of queries to one subsystem.
    pub questions: Rate,
    /// Maximum number of components per subsystem.
    pub max_components: usize,
    /// Maximum number of service messages per subsystem.
    pub max_commands: usize,
    /// Maximum number of subscriptions to our configurations.
    pub max_events: usize,
    /// Maximum number of messages queued for the owner.
    pub queue_limit: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            carrier: carrier::Settings::default(),
            heartbeat: Duration::from_secs(1),
            silence: Duration::from_secs(5),
            patience: Duration::from_millis(500),
            tries: 4,
            refresh: Duration::from_secs(10),
            review: Duration::from_secs(60),
            gather: Duration::from_millis(250),
            answers: Rate::new(200, 1000),
            questions: Rate::new(100, 400),
            max_components: 512,
            max_commands: 32_768,
            max_events: 1024,
            queue_limit: 4096,
        }
    }
}
