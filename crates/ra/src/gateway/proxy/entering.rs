//! Places that an RA component sets at JAUS drivers: its RA client adds them to their lists.

use std::time::Instant;

use bytes::Bytes;

use super::Proxy;
use super::codes::{RESET, SET_SPEED};
use super::listing::refuse;
use super::ra_client::RaClient;
use super::target::{RaRequest, Target, places};
use crate::RaId;
use crate::gateway::counters::{Counter, Tally};
use crate::gateway::course::{Entries, Want};
use jaus::codec::Message as _;
use jaus::endpoint::Received;
use jaus::messages::mobility::ReportActiveElement;
use jaus::service::{Inquiry, NoAnswer, Question, Stack};

impl RaClient {
    /// Maximum number of lists.
    const MOST_ENTRIES: usize = 16;

    /// Handles a message of the RA component that sets a place or a speed.
    pub(super) fn enter(&mut self, request: &mut RaRequest<'_>) -> bool {
        let RaRequest {
            now, message, peer, ..
        } = *request;
        let Some(places) = places(message, peer) else {
            return false;
        };
        let at = message.destination;
        if message.code == RESET {
            self.entries.remove(&at);
            return false;
        }
        if message.code != places.set && message.code != SET_SPEED {
            return false;
        }
        let is_new = !self.entries.contains_key(&at);
        if is_new && self.entries.len() >= Self::MOST_ENTRIES {
            request.refuse(Counter::TooManyWaiting);
            return true;
        }
        request.tally.add(Counter::CommandsFromRa);
        let patience = self.patience.interval * self.patience.tries;
        let new = || (peer, Entries::new(places, patience));
        let (_, entries) = self.entries.entry(at).or_insert_with(new);
        match message.code == SET_SPEED {
            true => entries.handle_speed(now, message.code, &message.data),
            false => entries.handle_set(now, &message.data),
        }
        self.follow_entries(now, at, request.stack, request.tally);
        true
    }

    /// Handles the active element of a JAUS driver, if the query was for a list.
    pub(super) fn handle_active(
        &mut self,
        now: Instant,
        inquiry: Inquiry,
        answer: &Result<Bytes, NoAnswer>,
        stack: &mut Stack,
        tally: &mut Tally,
    ) -> bool {
        let Some(at) = self.active.remove(&inquiry) else {
            return false;
        };
        let report = answer.as_ref().ok();
        let report = report.and_then(|report| ReportActiveElement::decode(report).ok());
        if let Some((_, entries)) = self.entries.get_mut(&at) {
            entries.handle_active(now, report.map(|it| it.element_uid));
        }
        self.follow_entries(now, at, stack, tally);
        true
    }

    /// Runs due timers of the lists.
    pub(super) fn handle_timeout(&mut self, now: Instant, stack: &mut Stack, tally: &mut Tally) {
        let due =
            |(_, entries): &(Target, Entries)| entries.poll_timeout().is_some_and(|due| due <= now);
        let due: Vec<RaId> = self
            .entries
            .iter()
            .filter(|(_, it)| due(it))
            .map(|(&at, _)| at)
            .collect();
        for at in due {
            if let Some((_, entries)) = self.entries.get_mut(&at) {
                entries.handle_timeout(now);
            }
            self.follow_entries(now, at, stack, tally);
        }
    }

    /// The next timeout of the lists.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let entries = self.entries.values();
        entries.filter_map(|(_, it)| it.poll_timeout()).min()
    }

    /// Executes the actions that a list requests.
    fn follow_entries(&mut self, now: Instant, at: RaId, stack: &mut Stack, tally: &mut Tally) {
        let Some((peer, entries)) = self.entries.get_mut(&at) else {
            return;
        };
        for want in entries.take_wants() {
            match want {
                Want::Send(payload) => stack.send_octets(peer.id, payload),
                Want::Ask(query) => {
                    let report = ReportActiveElement::CODE;
                    let inquiry =
                        stack.ask(now, peer.id, Question::new(query, report), self.patience);
                    self.active.insert(inquiry, at);
                }
                Want::Refuse(code, why) => refuse(now, tally, code, &why),
            }
        }
    }
}

impl Proxy {
    /// Handles an unsolicited message of a JAUS component; returns whether it confirms or refuses a
    /// list element.
    pub(in crate::gateway) fn handle_entered(
        &mut self,
        now: Instant,
        message: &Received,
        tally: &mut Tally,
    ) -> bool {
        let Self {
            ra_client, stack, ..
        } = self;
        let mut of_it = Vec::new();
        for (&at, (peer, entries)) in &mut ra_client.entries {
            if peer.id == message.source && entries.handle_answer(now, &message.payload) {
                of_it.push(at);
            }
        }
        for &at in &of_it {
            ra_client.follow_entries(now, at, stack, tally);
        }
        !of_it.is_empty()
    }
}
