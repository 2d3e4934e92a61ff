//! Tries a secure link without a node, to find out what keeps it from working.

use std::future::poll_fn;
use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use jaus::link::custom::CustomLink as _;
use jaus::node;

use super::SecureLink;
use crate::transport::{Act, Fault, SessionReport};

/// What became of the attempt to reach a peer.
pub type Reached = Result<SessionReport, Fault>;

impl SecureLink {
    /// Dials the peers of the settings; returns the session with each, or why there is none. Ends
    /// when each has a session or has refused, at the latest after this time.
    pub async fn probe(&mut self, peers: &[SocketAddr], limit: Duration) -> Vec<Reached> {
        let end = node::now() + limit;
        let mut faults: Vec<Option<Fault>> = vec![None; peers.len()];
        loop {
            let due = self.timeout.map_or(end, |due| due.min(end));
            let turn = poll_fn(|cx| self.turn(cx, peers, &mut faults));
            // Without an event in time the next turn handles what is due.
            let _ = tokio::time::timeout_at(due.into(), turn).await;
            let reached: Vec<_> = peers.iter().map(|&peer| self.session_with(peer)).collect();
            let settled = |(session, fault): (&Option<_>, &Option<Fault>)| {
                session.is_some() || fault.as_ref().is_some_and(|it| *it != Fault::NoAnswer)
            };
            if node::now() >= end || reached.iter().zip(&faults).all(settled) {
                let outcomes = reached.into_iter().zip(faults);
                return outcomes
                    .map(|(session, fault)| session.ok_or(fault.unwrap_or(Fault::NoAnswer)))
                    .collect();
            }
        }
    }

    /// Reads and sends what it can; ready if there was an event.
    fn turn(
        &mut self,
        cx: &mut Context<'_>,
        peers: &[SocketAddr],
        faults: &mut [Option<Fault>],
    ) -> Poll<()> {
        let now: Instant = node::now();
        let _ = self.poll_flush(cx, now);
        while self.poll_receive(cx, now).is_ready() {}
        let _ = self.poll_flush(cx, now);
        let mut has_event = false;
        while let Some((record, _)) = self.transport.poll_record() {
            has_event = true;
            if let (Act::HandshakeFailed(fault), Some(index)) = (
                record.act,
                peers.iter().position(|peer| *peer == record.address),
            ) {
                faults[index] = Some(fault);
            }
        }
        if has_event {
            Poll::Ready(())
        } else {
            Poll::Pending
        }
    }

    fn session_with(&self, peer: SocketAddr) -> Option<SessionReport> {
        self.transport.sessions().find(|it| it.address == peer)
    }
}
