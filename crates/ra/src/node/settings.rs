//! The settings of a node: times and bounds, with defaults that suit OpenJAUS.

use std::time::Duration;

use crate::carrier;
use jaus::endpoint::Rate;

/// The settings of an [`RaNode`](super::RaNode).
#[derive(Clone, Debug)]
pub struct Settings {
    /// How datagrams are read and written.
    pub carrier: carrier::Settings,
    /// How often each subsystem that we show tells that it is there. OpenJAUS: 1 s.
    pub heartbeat: Duration,
    /// How long another subsystem may be silent before it is lost. OpenJAUS: 5 s.
    pub silence: Duration,
    /// How long to wait for an answer before the question is asked again.
    pub patience: Duration,
    /// How often a question is asked before it is left until the next [`refresh`](Self::refresh).
    pub tries: u32,
    /// How often a subsystem's configuration is asked for again, in case that it tells no changes.
    pub refresh: Duration,
    /// How often names and services of all components are asked for again.
    pub review: Duration,
    /// How long changes of what we show are gathered before they are told: each of them makes
    /// OpenJAUS ask everything again.
    pub gather: Duration,
    /// Answers to one subsystem.
    pub answers: Rate,
    /// Questions to one subsystem.
    pub questions: Rate,
    /// The most components that are known of one subsystem.
    pub max_components: usize,
    /// The most messages of services that are known of one subsystem.
    pub max_commands: usize,
    /// The most subscriptions to our configurations.
    pub max_events: usize,
    /// The most messages that wait for the owner.
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
