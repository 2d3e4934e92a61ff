//! The Liveness service: answers heartbeat queries, and sends a periodic heartbeat if configured.

use std::time::{Duration, Instant};

use super::{Context, Handled, Service, code_of};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::{self, QueryHeartbeatPulse, ReportHeartbeatPulse};

/// Answers Query Heartbeat Pulse (2202h) by Report Heartbeat Pulse (4202h).
#[derive(Debug, Clone, Default)]
pub struct Liveness {
    heartbeat: Option<Heartbeat>,
}

#[derive(Debug, Clone)]
struct Heartbeat {
    to: JausId,
    every: Duration,
    /// `None` until the first wake-up has supplied the time.
    next: Option<Instant>,
}

impl Liveness {
    /// The shortest interval between two unsolicited heartbeats.
    pub const SHORTEST_INTERVAL: Duration = Duration::from_millis(10);

    /// Answers queries and sends nothing else.
    #[must_use]
    pub const fn new() -> Self {
        Self { heartbeat: None }
    }

    /// Sends a Report Heartbeat Pulse to `to` periodically, from the first
    /// [`Stack::start`](super::Stack::start). An interval below
    /// [`SHORTEST_INTERVAL`](Self::SHORTEST_INTERVAL) is raised to it.
    #[must_use]
    pub fn with_heartbeat(to: JausId, every: Duration) -> Self {
        let every = every.max(Self::SHORTEST_INTERVAL);
        Self {
            heartbeat: Some(Heartbeat {
                to,
                every,
                next: None,
            }),
        }
    }
}

impl Service for Liveness {
    fn offers(&self) -> Vec<ServiceId> {
        vec![core::liveness::V1_1, core::liveness::V1_0]
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        if code_of(&message.payload) != Some(QueryHeartbeatPulse::CODE) {
            return Handled::No;
        }
        context.reply(message, &ReportHeartbeatPulse {});
        Handled::Yes
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let Some(heartbeat) = &mut self.heartbeat else {
            return;
        };
        if heartbeat.next.is_none_or(|next| next <= now) {
            context.send(heartbeat.to, &ReportHeartbeatPulse {});
            heartbeat.next = Some(now + heartbeat.every);
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.heartbeat.as_ref()?.next
    }
}
