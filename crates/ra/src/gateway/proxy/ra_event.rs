//! One event that an RA component has at a JAUS component.

use bytes::Bytes;

use crate::gateway::convert::Words;
use crate::messages::ra33::Event;
use crate::messages::ra33::create_event::CreateEventRec;
use crate::{Message, RaId};
use jaus::service::Topic;

/// An event of the RA component.
#[derive(Debug)]
pub(super) struct RaEvent {
    /// Its number. All events of the RA component have different ones.
    pub(super) id: u8,
    /// The JAUS component as the RA component sees it.
    pub(super) at: RaId,
    /// The message that created or changed it, to answer.
    pub(super) request: Message,
    pub(super) wanted: CreateEventRec,
    pub(super) topic: Topic,
    pub(super) words: Words,
    /// Counts what was told.
    pub(super) sequence: u8,
    /// Whether the RA component knows that it has it.
    pub(super) confirmed: bool,
}

impl RaEvent {
    /// The message that tells a report.
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
