//! A stream of messages for display: whole messages that match a [`Filter`], each one shown once.
//!
//! Messages may come from a running node's [`Tap`](jaus::node::Tap), a capture, or JSON lines
//! written earlier. Fragments are reassembled here, away from the traffic itself. A message that is
//! retransmitted, routed, or carried on several links is shown at its first occurrence.
//! Acknowledgements are not shown.

mod entry;
mod fields;
mod filter;
mod passage;
mod seen;
#[cfg(test)]
mod tests;

use bytes::Bytes;
use serde_json::Value as Json;

use super::dictionary::Dictionary;
use super::log::{Arrival, MessageLog};
use super::network::Datagram;
use super::time::Timestamp;
use jaus::wire::{Frame, judp};

pub use entry::Entry;
pub use filter::{Filter, FilterError};
pub use passage::Links;
pub(super) use passage::timestamp;
pub(super) use seen::Seen;

/// Converts traffic to entries.
///
/// ```
/// use jaus_view::{Dictionary, Filter, MessageStream};
///
/// let filter: Filter = "message=ReportVelocityState".parse()?;
/// let dictionary = Dictionary::new();
/// let stream = MessageStream::new(&dictionary, filter);
/// assert!(stream.read_json(r#"{"message": "ReportVelocityState"}"#)?.is_some());
/// assert!(stream.read_json(r#"{"message": "QueryVelocityState"}"#)?.is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MessageStream<'d> {
    messages: MessageLog<'d>,
    filter: Filter,
    seen: Seen,
}

impl<'d> MessageStream<'d> {
    /// Creates a stream of messages that match `filter`, decoded with `dictionary`.
    #[must_use]
    pub fn new(dictionary: &'d Dictionary, filter: Filter) -> Self {
        Self {
            messages: MessageLog::new(dictionary),
            filter,
            seen: Seen::default(),
        }
    }

    /// Number of large messages with missing fragments so far.
    #[must_use]
    pub fn incomplete_messages(&self) -> u64 {
        self.messages.incomplete_messages()
    }

    /// The messages of a datagram in a capture; empty if it is not JAUS.
    pub fn read_datagram(
        &mut self,
        time: Option<Timestamp>,
        datagram: &Datagram<'_>,
    ) -> Vec<Entry> {
        let octets = Bytes::copy_from_slice(&datagram.payload);
        let arrival = Arrival {
            time,
            from: Some(datagram.source.ip()),
        };
        let Ok(frames) = judp::frames(octets) else {
            return Vec::new();
        };
        let frames = frames.map_while(Result::ok);
        let frames = frames.take_while(Frame::is_plausible);
        frames
            .filter_map(|frame| self.read_frame(arrival, &frame))
            .collect()
    }

    /// Reads a line of JSON written by this type or `jaus decode`; `None` if it does not match the
    /// filter. A message that its writer had no definition for is decoded here.
    ///
    /// # Errors
    /// If the line is not a JSON object, with the reason.
    pub fn read_json(&self, line: &str) -> Result<Option<Entry>, String> {
        match serde_json::from_str(line) {
            Ok(Json::Object(object)) => {
                let entry = Entry::of_object(self.messages.decoded(object));
                Ok(self.filter.passes(&entry).then_some(entry))
            }
            Ok(_) => Err("this is no JSON object".to_owned()),
            Err(error) => Err(error.to_string()),
        }
    }

    /// The message that a frame contains or completes, if it is to be shown.
    fn read_frame(&mut self, arrival: Arrival, frame: &Frame) -> Option<Entry> {
        let is_copy = |time| self.seen.is_copy(time, frame);
        if arrival.time.is_some_and(is_copy) {
            return None;
        }
        self.read_whole(arrival, frame, Vec::new())
    }

    /// The same for a frame without duplicate check.
    fn read_whole(
        &mut self,
        arrival: Arrival,
        frame: &Frame,
        way: Vec<(&'static str, String)>,
    ) -> Option<Entry> {
        if frame.is_acknowledgement() || !self.filter.may_pass(frame.source, frame.destination) {
            return None;
        }
        let line = self.messages.whole_message(arrival, frame)?;
        let entry = Entry::of_line(&line, way);
        self.filter.passes(&entry).then_some(entry)
    }
}
