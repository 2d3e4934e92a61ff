//! Changes while the node runs: of its own key or certificate, and of those that it accepts.

use std::time::{Duration, Instant};

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
        let (server, client) = parameters::of_sides(&self.credentials, &self.refusals);
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
        let (edition, wall) = (self.credentials.trust_edition(), self.credentials.now());
        let changed = edition != self.edition;
        self.edition = edition;
        let mut refused = Vec::new();
        for (&id, session) in &mut self.sessions {
            let expired = session.valid_until.is_some_and(|it| it < wall);
            if session.established().is_none() || !(changed || expired) {
                continue;
            }
            match session.identify(&self.credentials) {
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
