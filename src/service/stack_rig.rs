//! A test rig for a whole component without a network: its clients and its clock. The clients
//! answer Query Heartbeat Pulse automatically, unless they are dead.

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{Discovery, Kind, Profile, Scope, Service, Stack, Timing, code_of};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Path, Received};
use crate::messages::core::{QueryHeartbeatPulse, QueryIncarnation, ReportHeartbeatPulse};
use crate::wire::{Broadcast, Priority};

/// The component.
pub(crate) const US: JausId = JausId::new(105, 1, 1);

/// A message and its receiver.
pub(crate) type Sent = (JausId, Bytes);

pub(crate) struct StackRig {
    pub(crate) stack: Stack,
    pub(crate) now: Instant,
    /// Clients that no longer answer.
    pub(crate) dead: Vec<JausId>,
    /// The next sequence number of the clients' messages; none if they come from the same node.
    pub(crate) number: Option<u16>,
}

impl StackRig {
    /// A component without search, with these services and settings.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(crate) fn new(
        services: Vec<Box<dyn Service>>,
        settings: impl FnOnce(Stack) -> Stack,
    ) -> Self {
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(US, profile, Scope::Nobody, Timing::default(), 1);
        Self {
            stack: settings(Stack::new(discovery, services)),
            now: Instant::now(),
            dead: Vec::new(),
            number: None,
        }
    }

    /// Handles a client's message; returns the messages to it and to others.
    pub(crate) fn hear<M: Message>(&mut self, source: JausId, message: &M) -> Vec<Sent> {
        self.hear_on(None, source, message)
    }

    /// The same with a message from the network.
    pub(crate) fn hear_on<M: Message>(
        &mut self,
        path: Option<Path>,
        source: JausId,
        message: &M,
    ) -> Vec<Sent> {
        let received = Received {
            source,
            destination: US,
            to: US,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload: message.encode().unwrap(),
            sequence: self.number,
            path,
            acknowledged: false,
        };
        self.number = self.number.map(|number| number.wrapping_add(1));
        self.stack.handle_message(self.now, &received);
        self.said()
    }

    /// The messages sent since the last call, without the probes.
    pub(crate) fn said(&mut self) -> Vec<Sent> {
        let mut said = Vec::new();
        while let Some(message) = self.stack.poll_transmit() {
            let client = message.destination;
            let code = code_of(&message.payload);
            if code == Some(QueryIncarnation::CODE) {
                continue;
            } else if code != Some(QueryHeartbeatPulse::CODE) {
                said.push((client, message.payload));
            } else if !self.dead.contains(&client) {
                said.extend(self.hear(client, &ReportHeartbeatPulse {}));
            }
        }
        said
    }

    /// Advances the time, and wakes the component once.
    pub(crate) fn pass(&mut self, time: Duration) -> Vec<Sent> {
        self.now += time;
        self.stack.handle_timeout(self.now);
        self.said()
    }

    /// Advances the time from wake-up to wake-up; returns the messages and their times.
    pub(crate) fn run(&mut self, time: Duration) -> Vec<(Duration, JausId, Bytes)> {
        let (start, end) = (self.now, self.now + time);
        let mut said = Vec::new();
        while let Some(wake) = self.stack.poll_timeout()
            && wake <= end
        {
            self.now = self.now.max(wake);
            self.stack.handle_timeout(self.now);
            let at = self.now - start;
            said.extend(self.said().into_iter().map(|(to, it)| (at, to, it)));
        }
        self.now = end;
        said
    }
}
