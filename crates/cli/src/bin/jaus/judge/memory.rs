//! What a run remembers from one exchange to the next, and of whom.

use std::collections::BTreeMap;

use jaus::address::JausId;
use serde_json::Value as Json;

/// One of the five components that the judge speaks with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Speaker {
    /// 42.1.1: asks, subscribes and drives.
    Main,
    /// 42.2.1: takes control first.
    First,
    /// 42.2.2: wants control with too little authority.
    Second,
    /// 42.2.3: takes control from the first.
    Third,
    /// 42.2.4: declares emergencies.
    Fourth,
}

impl Speaker {
    pub(super) const ALL: [Self; 5] = [
        Self::Main,
        Self::First,
        Self::Second,
        Self::Third,
        Self::Fourth,
    ];
}

/// An event stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stream {
    pub(super) id: u8,
    /// The code of the report that it carries.
    pub(super) report: u16,
}

/// What earlier answers told, for later questions and checks.
#[derive(Debug)]
pub(super) struct Memory {
    /// Who is judged.
    pub(super) subject: JausId,
    /// The judge's own ids, in the order of [`Speaker::ALL`].
    pub(super) judge_nodes: [JausId; 5],
    /// The event stream of the steps on events.
    pub(super) event: Option<u8>,
    /// All event streams that were confirmed and not cancelled, the oldest first.
    pub(super) streams: Vec<Stream>,
    /// The position that was reported before a command that must be ignored.
    pub(super) position: Option<[f64; 2]>,
    /// The time stamp of the last report that had one, in milliseconds of the day.
    pub(super) time: Option<u32>,
    /// What the service that is walked through reported last, by code.
    pub(super) reports: BTreeMap<u16, Json>,
    /// The last velocity along X, in metres a second.
    pub(super) speed: Option<f64>,
    /// How many waypoints of the drive have been reached, in their order.
    pub(super) reached: usize,
}

impl Memory {
    pub(super) fn new(subject: JausId, judge_nodes: [JausId; 5]) -> Self {
        Self {
            subject,
            judge_nodes,
            event: None,
            streams: Vec::new(),
            position: None,
            time: None,
            reports: BTreeMap::new(),
            speed: None,
            reached: 0,
        }
    }

    /// The id of one of the judge's components.
    pub(super) const fn id(&self, speaker: Speaker) -> JausId {
        self.judge_nodes[speaker as usize]
    }

    /// The event stream that an earlier step created.
    pub(super) fn event(&self) -> Result<u8, String> {
        self.event
            .ok_or_else(|| "there is no event: its creation (step B4) was not confirmed".to_owned())
    }

    /// Takes an event stream down as cancelled.
    pub(super) fn forget_stream(&mut self, id: u8) {
        self.streams.retain(|stream| stream.id != id);
    }
}
