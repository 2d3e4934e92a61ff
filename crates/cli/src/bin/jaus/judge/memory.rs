//! State of a run across exchanges, and the judge's components.

use std::collections::BTreeMap;

use jaus::address::JausId;
use serde_json::Value as Json;

/// One of the judge's five components.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Speaker {
    /// 42.1.1: queries, subscribes and drives.
    Main,
    /// 42.2.1: takes control first.
    First,
    /// 42.2.2: requests control with too little authority.
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
    /// The code of the report in its events.
    pub(super) report: u16,
}

/// Values from earlier answers, for later queries and checks.
#[derive(Debug)]
pub(super) struct Memory {
    /// The component under test.
    pub(super) subject: JausId,
    /// The judge's own ids, in the order of [`Speaker::ALL`].
    pub(super) judge_nodes: [JausId; 5],
    /// The event stream of the event steps.
    pub(super) event: Option<u8>,
    /// All confirmed and not cancelled event streams, the oldest first.
    pub(super) streams: Vec<Stream>,
    /// The reported position before a command that must be ignored.
    pub(super) position: Option<[f64; 2]>,
    /// The time stamp of the last report with one, in milliseconds of the day.
    pub(super) time: Option<u32>,
    /// The last reports of the service under test, by code.
    pub(super) reports: BTreeMap<u16, Json>,
    /// The last velocity along X, in m/s.
    pub(super) speed: Option<f64>,
    /// Number of waypoints reached, in order.
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

    /// The event stream of an earlier step.
    pub(super) fn event(&self) -> Result<u8, String> {
        self.event
            .ok_or_else(|| "no event exists: step B4 did not confirm its creation".to_owned())
    }

    /// Notes the cancellation of an event stream.
    pub(super) fn forget_stream(&mut self, id: u8) {
        self.streams.retain(|stream| stream.id != id);
    }
}
