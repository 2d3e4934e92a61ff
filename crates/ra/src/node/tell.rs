//! Sends heartbeats and configuration changes of our subsystems.
//!
//! OpenJAUS repeats each query to every component for each reported change. Changes in quick
//! succession are therefore collected and sent once.
//!
//! A peer that knew us before our restart has not noticed it and does not subscribe again. Peers
//! without a subscription therefore receive an ordinary Report Configuration, which OpenJAUS
//! accepts in the same way: at each change, and once when the time to subscribe has passed.

use std::time::Instant;

use super::RaNode;
use super::own::Own;
use super::peer::Peer;
use crate::RaId;
use crate::carrier::SendError;
use crate::message::Message;
use crate::messages::ra33::query_configuration::QueryField;
use crate::messages::ra33::{
    QueryConfiguration, QueryHeartbeatPulse, ReportConfiguration, ReportHeartbeatPulse,
};
use jaus::codec::Message as _;

impl RaNode {
    /// Multicasts the heartbeat of a local subsystem, if it is due.
    pub(super) fn heartbeat(&mut self, now: Instant, subsystem: u8) {
        let Some(own) = self.own.get_mut(&subsystem) else {
            return;
        };
        if own.next_heartbeat > now {
            return;
        }
        own.next_heartbeat = now + self.settings.heartbeat;
        let everybody = RaId::new(RaId::ALL, RaId::ALL, RaId::NODE_MANAGER, 1);
        let code = ReportHeartbeatPulse::CODE;
        let heartbeat = Message::new(own.communicator(), everybody, code, bytes::Bytes::new());
        self.transmit(&heartbeat);
        if let Some(asker) = self.asker().filter(|asker| asker.subsystem == subsystem) {
            self.feel_pulses(now, asker);
        }
    }

    /// Queries the heartbeat of silent peers that multicast does not reach.
    fn feel_pulses(&mut self, now: Instant, asker: RaId) {
        let named = &self.settings.carrier.peers;
        let is_silent = |(id, peer): &(&u8, &Peer)| {
            let host = self.carrier.address(**id).map(|address| address.ip());
            let since = now.saturating_duration_since(peer.heard);
            host.is_some_and(|host| named.contains(&host)) && since >= self.settings.heartbeat
        };
        let silent = self.peers.iter().filter(is_silent);
        let silent: Vec<_> = silent.map(|(_, peer)| peer.communicator).collect();
        for communicator in silent {
            let code = QueryHeartbeatPulse::CODE;
            self.transmit(&Message::new(
                asker,
                communicator,
                code,
                bytes::Bytes::new(),
            ));
        }
    }

    /// Sends the collected changes of a local subsystem, if they are due.
    pub(super) fn tell_changes(&mut self, now: Instant, subsystem: u8) {
        if let Some(own) = self.own.get_mut(&subsystem)
            && own.tell.is_some_and(|tell| tell <= now)
        {
            own.tell = None;
            self.tell_all(subsystem, false);
        }
    }

    /// Sends the configuration of a local subsystem to all peers; an empty one with `gone`.
    pub(super) fn tell_all(&mut self, subsystem: u8, gone: bool) {
        let peers = self.peers.iter();
        let peers = peers.filter(|(_, peer)| gone || peer.greet.is_none());
        let peers: Vec<_> = peers.map(|(&peer, _)| peer).collect();
        for peer in peers {
            self.tell_without_subscription(subsystem, peer, gone);
        }
        self.tell_subscribers(subsystem, gone);
    }

    fn tell_subscribers(&mut self, subsystem: u8, gone: bool) {
        let Some(own) = self.own.get_mut(&subsystem) else {
            return;
        };
        let mut subscriptions = std::mem::take(&mut own.subscriptions);
        let mut events = Vec::new();
        for (&event, subscription) in &mut subscriptions {
            let (at, query) = subscription.question();
            let report = report(own, at, &query, gone);
            if let Some(Ok(message)) = report.map(|report| subscription.event(event, &report)) {
                events.push((event, message));
            }
        }
        for (event, message) in events {
            if let Err(SendError::Unknown(_)) = self.carrier.send(&message) {
                subscriptions.remove(&event);
            }
        }
        if let Some(own) = self.own.get_mut(&subsystem) {
            own.subscriptions = subscriptions;
        }
    }

    /// Sends the configuration of a local subsystem to a peer that has not subscribed to it.
    fn tell_without_subscription(&mut self, subsystem: u8, peer: u8, gone: bool) {
        let (Some(own), Some(known)) = (self.own.get(&subsystem), self.peers.get(&peer)) else {
            return;
        };
        let mut clients = own.subscriptions.values().map(|known| known.client());
        if clients.any(|client| client.subsystem == peer) {
            return;
        }
        let (from, to) = (own.communicator(), known.manager());
        let query = QueryConfiguration {
            query_field: QueryField::SUBSYSTEM,
        };
        let report = report(own, from, &query, gone);
        let message = report.map(|report| Message::with_body(from, to, &report));
        if let Some(Ok(message)) = message {
            self.transmit(&message);
        }
    }

    /// Sends our configurations to a peer that did not subscribe in time.
    pub(super) fn greet(&mut self, now: Instant, peer: u8) {
        let Some(known) = self.peers.get_mut(&peer) else {
            return;
        };
        if known.greet.take_if(|greet| *greet <= now).is_none() || !known.configured {
            return;
        }
        let own: Vec<_> = self.own.keys().copied().collect();
        for subsystem in own {
            self.tell_without_subscription(subsystem, peer, false);
        }
    }
}

/// The configuration report of a local subsystem.
fn report(
    own: &Own,
    at: RaId,
    query: &QueryConfiguration,
    gone: bool,
) -> Option<ReportConfiguration> {
    if gone {
        return Some(ReportConfiguration::default());
    }
    own.configuration(at, query)
}
