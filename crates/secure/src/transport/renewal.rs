//! Changes while the node runs: of its own key or certificate, and of those that it accepts.

use std::time::{Duration, Instant};

use jaus::link::custom::Arrival;

use super::session::Session;
use super::{Counter, Transport, code, parameters};

/// The interval of warnings about the node's own certificate.
pub(super) const REMINDER_PAUSE: Duration = Duration::from_secs(24 * 60 * 60);
/// Why a session ends whose peer was accepted before.
pub(super) const NOT_ACCEPTED: &str = "the key or certificate is no longer accepted";

impl Transport {
    /// Uses a new key or certificate of the node: all sessions end, and the dialling sides renew
    /// them at once.
    pub(super) fn apply_own(&mut self, now: Instant) {
        let edition = self.credentials.own_edition();
        if edition == self.own_edition {
            return;
        }
        self.own_edition = edition;
        self.own = self.credentials.public();
        let (server, client) =
            parameters::of_sides(&self.credentials, &self.refusals, &self.tokens);
        self.endpoint.set_server_config(Some(server));
        self.client = client;
        tracing::info!(key = %self.own, "the node's key or certificate was replaced");
        for id in self.sessions.keys().copied().collect::<Vec<_>>() {
            self.end(
                now,
                id,
                code::RENEWED,
                "the peer has another key or certificate",
            );
        }
        for dial in &mut self.dials {
            dial.hasten();
        }
    }

    /// Closes the sessions of peers that are no longer accepted, and applies changes of ids.
    pub(super) fn apply_trust(&mut self, now: Instant) {
        self.report_fault();
        let (edition, wall) = (self.credentials.trust_edition(), self.credentials.now());
        let changed = edition != self.edition;
        self.edition = edition;
        if changed {
            self.verify_rules();
        }
        let mut refused = Vec::new();
        for (&id, session) in &mut self.sessions {
            let expired = session.valid_until.is_some_and(|it| it < wall);
            if session.established().is_none() || !(changed || expired) {
                continue;
            }
            match session.identify(|shown| self.credentials.identify(shown)) {
                Ok(identified) => session.peer = Some(identified.peer),
                Err(rejection) => {
                    tracing::warn!(%rejection, "the session ends");
                    refused.push(id);
                }
            }
        }
        for id in refused {
            self.end(now, id, code::REVOKED, NOT_ACCEPTED);
        }
        if changed {
            self.tell_spoken();
        }
    }

    /// Tells the node for which ids the peers may speak, so that it believes no other link in these ids:
    /// those of all trusted keys, and those of the certificates that were shown so far.
    pub(super) fn tell_spoken(&mut self) {
        let mut spoken = self.credentials.trust().ids();
        let certified = self.sessions.values().filter_map(Session::established);
        spoken.extend(certified.flat_map(|peer| peer.ids.iter().copied()));
        if self.credentials.uses_certificates() {
            spoken.append(&mut self.spoken.clone());
        }
        spoken.sort_unstable();
        spoken.dedup();
        if spoken != self.spoken {
            self.spoken.clone_from(&spoken);
            self.arrivals.push_back(Arrival::Speaks(spoken));
        }
    }

    /// Says if a name in the rules of the peers means nothing.
    pub(super) fn verify_rules(&self) {
        if let Err((peer, error)) = self.credentials.trust().verify(&self.table) {
            tracing::warn!(peer, %error, "rules of a trusted peer");
        }
    }

    /// Says when new sessions begin or cease to be refused, and whom that leaves connected: a peer that was
    /// to be revoked may be among them.
    fn report_fault(&mut self) {
        let fault = self.credentials.fault();
        if fault == self.fault {
            return;
        }
        let peers = self.sessions.values().filter_map(Session::established);
        let peers: Vec<_> = peers.map(|it| it.name.as_str()).collect();
        let connected = match peers[..] {
            [] => "nobody".to_owned(),
            _ => peers.join(", "),
        };
        match &fault {
            Some(reason) => tracing::error!(
                connected,
                "new secure sessions are refused, because {reason}; those of the connected peers remain, \
                 also of one that was to be revoked: make the file usable, or stop the node"
            ),
            None => tracing::info!(connected, "new secure sessions are accepted again"),
        }
        self.fault = fault;
    }

    /// Warns of a certificate of the node that expires soon.
    pub(super) fn remind(&mut self, now: Instant) {
        if self.reminded.is_some_and(|at| now < at + REMINDER_PAUSE) {
            return;
        }
        if !self.credentials.uses_certificates() {
            return;
        }
        if let Some(warning) = self.credentials.warning() {
            self.reminded = Some(now);
            self.counters.add(Counter::ExpiryReminders);
            tracing::warn!("the certificate of this node: {warning}");
        }
    }
}
