//! What was sent, and the judgement about what comes out.
//!
//! Each message of a scenario has a code of its own, so that every copy of it is known, whatever its
//! length.

use std::collections::HashMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::{Event, MessageHandle, Outgoing, Received};

use crate::sim::Random;

/// One life of a node, from its start or restart on: the node and how often it was restarted.
pub(crate) type Life = (usize, u32);

/// A message that was sent.
struct Sent {
    by: Life,
    message: Outgoing,
    at: Instant,
    /// For whom it may be: components and the lives that they had when it was sent.
    receivers: Vec<(JausId, Life)>,
    /// The shortest time after which the same message may be delivered once more.
    window: Option<Duration>,
    /// When it was delivered to whom.
    delivered: HashMap<(JausId, Life), Instant>,
    /// Whether the result was told.
    told: bool,
}

/// What was sent. See the [module](self).
#[derive(Default)]
pub(crate) struct Ledger {
    sent: Vec<Sent>,
    handles: HashMap<(Life, MessageHandle), usize>,
    noise: Bytes,
    pub(crate) acknowledged: u64,
    pub(crate) given_up: u64,
    pub(crate) delivered: u64,
}

impl Ledger {
    pub(crate) fn new(random: &mut Random, longest: usize) -> Self {
        let noise = (0..longest / 4).flat_map(|_| random.number().to_le_bytes());
        Self {
            noise: noise.collect(),
            ..Self::default()
        }
    }

    /// A payload of so many octets, at least 2, that no other message has.
    pub(crate) fn payload(&mut self, random: &mut Random, length: usize) -> Bytes {
        let code = self.sent.len() as u16 + 1;
        let start = random.below(self.noise.len() - length);
        let content: Range<usize> = start..start + length - 2;
        let mut payload = BytesMut::with_capacity(length);
        payload.put_u16_le(code);
        payload.put_slice(&self.noise[content]);
        payload.freeze()
    }

    /// Takes note of a message that was sent.
    pub(crate) fn enter(
        &mut self,
        at: Instant,
        (by, handle): (Life, MessageHandle),
        message: Outgoing,
        receivers: Vec<(JausId, Life)>,
        window: Option<Duration>,
    ) {
        self.handles.insert((by, handle), self.sent.len());
        self.sent.push(Sent {
            by,
            message,
            at,
            receivers,
            window,
            delivered: HashMap::new(),
            told: false,
        });
    }

    /// Judges a message that was delivered in one life of a node.
    pub(crate) fn receive(
        &mut self,
        at: Instant,
        life: Life,
        received: &Received,
    ) -> Result<(), String> {
        let code = u16::from_le_bytes([received.payload[0], received.payload[1]]);
        let sent = usize::from(code).checked_sub(1);
        let Some(sent) = sent.and_then(|sent| self.sent.get_mut(sent)) else {
            return Err(format!("message {code} was delivered and never sent"));
        };
        let message = &sent.message;
        if received.payload != message.payload {
            let (is, was) = (received.payload.len(), message.payload.len());
            return Err(format!(
                "message {code} changed: {is} octets, sent were {was}"
            ));
        }
        let same = (received.source, received.destination, received.priority)
            == (message.source, message.destination, message.priority);
        if !same
            || !sent
                .receivers
                .iter()
                .any(|(id, (host, _))| (*id, *host) == (received.to, life.0))
        {
            return Err(format!(
                "message {code} was delivered to {} of node {}",
                received.to, life.0
            ));
        }
        self.delivered += 1;
        if let Some(before) = sent.delivered.insert((received.to, life), at) {
            let since = at - before;
            if sent.window.is_none_or(|window| since < window) {
                return Err(format!(
                    "message {code} was delivered again after {since:?}"
                ));
            }
        }
        Ok(())
    }

    /// Judges a result that was told in one life of a node. `forgetful` tells which nodes have
    /// forgotten fragments for want of room or time.
    pub(crate) fn learn(
        &mut self,
        life: Life,
        event: &Event,
        forgetful: impl Fn(usize) -> bool,
        lives: &[u32],
    ) -> Result<(), String> {
        let (handle, acknowledged) = match event {
            Event::Acknowledged { message, .. } => (*message, true),
            Event::NotAcknowledged { message, .. } => (*message, false),
            _ => return Ok(()),
        };
        let Some(&number) = self.handles.get(&(life, handle)) else {
            return Err(format!(
                "node {} is told about {handle:?}, never sent",
                life.0
            ));
        };
        let sent = &mut self.sent[number];
        let code = number + 1;
        if !sent.message.acknowledge || std::mem::replace(&mut sent.told, true) {
            return Err(format!("message {code} has a result too many"));
        }
        if !acknowledged {
            self.given_up += 1;
            return Ok(());
        }
        self.acknowledged += 1;
        let [(receiver, (host, life))] = sent.receivers[..] else {
            return Err(format!("message {code} is acknowledged by nobody known"));
        };
        let restarted = lives[host] != life;
        let there = sent.delivered.contains_key(&(receiver, (host, life)));
        if there || restarted || forgetful(host) {
            Ok(())
        } else {
            Err(format!(
                "message {code} is acknowledged and was not delivered"
            ))
        }
    }

    /// Judges what is left when nothing happens any more.
    pub(crate) fn close(&self, lives: &[u32]) -> Result<(), String> {
        for (number, sent) in self.sent.iter().enumerate() {
            let alive = lives[sent.by.0] == sent.by.1;
            if sent.message.acknowledge && alive && !sent.told {
                let code = number + 1;
                return Err(format!("message {code} of {:?} has no result", sent.at));
            }
        }
        Ok(())
    }
}
