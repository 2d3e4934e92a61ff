//! Answers queries to our components.
//!
//! OpenJAUS answers for the subsystem only at the communicator and for a node only at its manager.
//! Here every component answers every query, from the addressed id.

use std::time::Instant;

use super::RaNode;
use crate::RaId;
use crate::counters::Counter;
use crate::message::Message;
use crate::messages::ra33::{
    QueryConfiguration, QueryHeartbeatPulse, QueryIdentification, QueryServices,
    ReportHeartbeatPulse,
};
use jaus::codec;

impl RaNode {
    /// Answers a query for each addressed component.
    pub(super) fn answer(&mut self, now: Instant, query: &Message) {
        let asked: Vec<_> = self.carrier.recipients(query.destination).collect();
        for id in asked {
            if !self.answers.take(now, query.source.subsystem) {
                self.carrier.count(Counter::AnswerRate);
                return;
            }
            if self.answer_at(id, query).is_none() {
                self.carrier.count(Counter::Malformed);
            }
        }
    }

    fn answer_at(&mut self, id: RaId, query: &Message) -> Option<()> {
        use codec::Message as _;
        let own = self.own.get(&id.subsystem)?;
        let to = query.source;
        let answer = match query.code {
            QueryIdentification::CODE => {
                let report = own.identification(id, &query.body().ok()?)?;
                Message::with_body(id, to, &report)
            }
            QueryConfiguration::CODE => {
                let report = own.configuration(id, &query.body::<QueryConfiguration>().ok()?)?;
                Message::with_body(id, to, &report)
            }
            QueryServices::CODE => Message::with_body(id, to, &own.services(id)?),
            QueryHeartbeatPulse::CODE => Message::with_body(id, to, &ReportHeartbeatPulse),
            _ => return None,
        };
        let answer = Message {
            priority: query.priority,
            ..answer.ok()?
        };
        self.transmit(&answer);
        Some(())
    }

    /// Sends a message of the node. The carrier counts failures; peers repeat their queries.
    pub(super) fn transmit(&mut self, message: &Message) {
        if let Err(error) = self.carrier.send(message) {
            tracing::debug!(?message, %error, "not sent");
        }
    }
}
