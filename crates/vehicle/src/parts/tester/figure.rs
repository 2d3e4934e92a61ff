//! Message log lines in the form of a protocol figure: time, source, destination, name and sequence
//! number.

use std::fmt;
use std::time::{Duration, SystemTime};

use bytes::Bytes;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::Event;
use jaus::node::{Passage, Way};
use jaus::service::code_of;
use jaus::wire::{Acknowledgement, Frame};

use crate::messages::registry;

/// A message on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Time since the start.
    pub time: Duration,
    /// The sender.
    pub source: JausId,
    /// The destination.
    pub destination: JausId,
    /// The message code.
    pub code: u16,
    /// The message name. For an event, with the name of the report it carries.
    pub name: String,
    /// The transport sequence number; `None` between components of one node.
    pub sequence: Option<u16>,
    /// Whether it is an acknowledgement or requests one.
    pub acknowledgement: Acknowledgement,
}

/// The messages of one passage.
#[must_use]
pub fn lines(passage: &Passage, begin: SystemTime) -> Vec<Line> {
    let time = passage.time.duration_since(begin).unwrap_or_default();
    let is_local = matches!(passage.way, Way::Local(_));
    let frames = passage.frames().into_iter();
    frames
        .filter_map(|frame| line(&frame, time, is_local))
        .collect()
}

fn line(frame: &Frame, time: Duration, is_local: bool) -> Option<Line> {
    let code = frame.code()?;
    Some(Line {
        time,
        source: frame.source,
        destination: frame.destination,
        code,
        name: name(code, &frame.payload),
        sequence: (!is_local).then_some(frame.sequence),
        acknowledgement: frame.flags.acknowledgement(),
    })
}

fn name(code: u16, payload: &Bytes) -> String {
    if code == Event::CODE
        && let Ok(event) = Event::decode(payload)
        && let Some(inner) = code_of(&event.report_message)
    {
        return format!("Event({})", plain_name(inner));
    }
    plain_name(code)
}

fn plain_name(code: u16) -> String {
    registry()
        .by_code(code)
        .next()
        .map_or_else(|| format!("{code:04X}h"), |info| info.name.to_owned())
}

impl Line {
    /// Whether the message belongs to discovery or event maintenance.
    #[must_use]
    pub fn is_chatter(&self) -> bool {
        let subject = self.code & 0x0FFF;
        let is_upkeep = matches!(subject, 0x0B00..=0x0B0F | 0x0202 | 0x01F0..=0x01FF);
        is_upkeep && self.code != Event::CODE
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sequence = self
            .sequence
            .map_or_else(|| "-".to_owned(), |number| number.to_string());
        let mark = match self.acknowledgement {
            Acknowledgement::None => "",
            Acknowledgement::Request => "  requests acknowledgement",
            Acknowledgement::Positive => "  acknowledges",
            Acknowledgement::Negative => "  negative acknowledgement",
        };
        write!(
            f,
            "{:>9.3} s  {:>11} → {:<11}  {:04X}h  {:<36} #{sequence:<5}{mark}",
            self.time.as_secs_f64(),
            self.source.to_string(),
            self.destination.to_string(),
            self.code,
            self.name
        )
    }
}
