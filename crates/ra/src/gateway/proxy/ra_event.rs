//! An event of an RA component at a JAUS component.

use bytes::Bytes;

use crate::RaId;
use crate::gateway::convert::Words;
use crate::message::Message;
use crate::messages::ra33::Event;
use crate::messages::ra33::create_event::CreateEventRec;
use jaus::service::Topic;

/// An event of the RA component.
#[derive(Debug)]
pub(super) struct RaEvent {
    /// Event number, unique per RA component.
    pub(super) id: u8,
    /// RA id of the JAUS component.
    pub(super) at: RaId,
    /// The request that created or changed it, to answer.
    pub(super) request: Message,
    pub(super) wanted: CreateEventRec,
    pub(super) topic: Topic,
    pub(super) words: Words,
    /// Sequence number of the next report.
    pub(super) sequence: u8,
    /// Whether the event is confirmed to the RA component.
    pub(super) confirmed: bool,
}

impl RaEvent {
    /// Builds the event message of a report.
    pub(super) fn tell(&mut self, report_message: Bytes) -> Option<Message> {
        let event = Event {
            event_id: self.id,
            report_code: self.wanted.report_code,
            sequence_number: self.sequence,
            report_message,
        };
        self.sequence = self.sequence.wrapping_add(1);
        Message::with_body(self.at, self.request.source, &event).ok()
    }
}
