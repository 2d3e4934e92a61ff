//! Ledger of a scenario: sent messages, their receivers, and their delivery.
//!
//! Each message of a scenario has a unique code, so that every copy is recognised at any length.

use std::collections::HashMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::{Event, MessageHandle, Outgoing, Received};

use crate::sim::Random;
use crate::totals::Counts;

/// The message code of all forged messages.
pub(crate) const FORGED: u16 = 0xFFFF;

/// One life of a node, from a start or restart: the node and its number of restarts before.
pub(crate) type Life = (usize, u32);

/// A sent message.
struct Sent {
    by: Life,
    message: Outgoing,
    at: Instant,
    /// Possible receivers: components, and their nodes' lives at the time of sending.
    receivers: Vec<(JausId, Life)>,
    /// The shortest time after which the same message may be delivered again.
    window: Duration,
    /// Per receiver, the last delivery and the number of deliveries.
    delivered: HashMap<(JausId, Life), (Instant, u32)>,
    /// Whether it was acknowledged; `None` until the result is known.
    result: Option<bool>,
    /// Whether the wire corrupted bits when it was sent, so that no promise holds.
    is_at_risk: bool,
}

/// The sent messages. See the [module](self).
pub(crate) struct Ledger {
    sent: Vec<Sent>,
    handles: HashMap<(Life, MessageHandle), usize>,
    noise: Bytes,
    /// Whether the wire corrupts bits now.
    is_at_risk: bool,
    /// From this message on, every message must be fulfilled.
    calm: usize,
    pub(crate) counts: Counts,
}

impl Ledger {
    /// Events that must happen in some seed. A repeated delivery is counted too, but it is rare, and
    /// allowed rather than promised.
    const NAMES: [&str; 7] = [
        "delivered",
        "delivered corrupted",
        "delivered forged",
        "acknowledged",
        "given up",
        "peers moved",
        "delivered after healing",
    ];

    pub(crate) fn new(random: &mut Random, longest: usize, is_at_risk: bool) -> Self {
        let noise = (0..longest / 4).flat_map(|_| random.number().to_le_bytes());
        Self {
            sent: Vec::new(),
            handles: HashMap::new(),
            noise: noise.collect(),
            is_at_risk,
            calm: usize::MAX,
            counts: Self::NAMES.map(|name| (name, 0)).into(),
        }
    }

    fn count(&mut self, name: &'static str) {
        *self.counts.entry(name).or_default() += 1;
    }

    /// A unique payload of `length` octets, at least 2.
    pub(crate) fn payload(&mut self, random: &mut Random, length: usize) -> Bytes {
        let code = self.sent.len() as u16 + 1;
        let start = random.below(self.noise.len() - length);
        let content: Range<usize> = start..start + length - 2;
        let mut payload = BytesMut::with_capacity(length);
        payload.put_u16_le(code);
        payload.put_slice(&self.noise[content]);
        payload.freeze()
    }

    /// Records a sent message.
    pub(crate) fn enter(
        &mut self,
        at: Instant,
        (by, handle): (Life, MessageHandle),
        message: Outgoing,
        receivers: Vec<(JausId, Life)>,
        window: Duration,
    ) {
        self.handles.insert((by, handle), self.sent.len());
        self.sent.push(Sent {
            by,
            message,
            at,
            receivers,
            window,
            delivered: HashMap::new(),
            result: None,
            is_at_risk: self.is_at_risk,
        });
    }

    /// From now on, every message must be fulfilled: delivered once to each receiver, and
    /// acknowledged if requested.
    pub(crate) fn expect_all(&mut self) {
        self.is_at_risk = false;
        self.calm = self.sent.len();
    }

    /// Checks a message delivered in one life of a node. `is_strict` tells whether the node reads
    /// all messages at once and has room for all its peers, so that it need not forget their
    /// sequence numbers.
    pub(crate) fn receive(
        &mut self,
        at: Instant,
        life: Life,
        received: &Received,
        is_strict: bool,
    ) -> Result<(), String> {
        let code = u16::from_le_bytes([received.payload[0], received.payload[1]]);
        if code == FORGED {
            self.count("delivered forged");
            return Ok(());
        }
        let place = usize::from(code).wrapping_sub(1);
        match self.identify(place, life, received) {
            Ok(()) => {}
            Err(_) if self.is_at_risk => {
                self.count("delivered corrupted");
                return Ok(());
            }
            Err(reason) => return Err(format!("message {code} {reason}")),
        }
        self.count("delivered");
        if place >= self.calm {
            self.count("delivered after healing");
        }
        let sent = &mut self.sent[place];
        let Some((before, times)) = sent.delivered.get_mut(&(received.to, life)) else {
            sent.delivered.insert((received.to, life), (at, 1));
            return Ok(());
        };
        let since = at - std::mem::replace(before, at);
        *times += 1;
        if since < sent.window && is_strict && !sent.is_at_risk {
            return Err(format!(
                "message {code} was delivered again after {since:?}"
            ));
        }
        self.count("delivered again");
        Ok(())
    }

    /// Checks that a delivered message equals the sent one, and has the right receiver.
    fn identify(&self, place: usize, life: Life, received: &Received) -> Result<(), String> {
        let sent = self.sent.get(place).ok_or("was never sent")?;
        let message = &sent.message;
        if received.payload != message.payload {
            let (is, was) = (received.payload.len(), message.payload.len());
            return Err(format!("changed: {is} octets, sent were {was}"));
        }
        let same = (received.source, received.destination, received.priority)
            == (message.source, message.destination, message.priority);
        let mut receivers = sent.receivers.iter();
        if same && receivers.any(|(id, (node, _))| (*id, *node) == (received.to, life.0)) {
            return Ok(());
        }
        let (to, node) = (received.to, life.0);
        Err(format!("was delivered to {to} of node {node}"))
    }

    /// Checks a result reported in one life of a node.
    pub(crate) fn learn(&mut self, life: Life, event: &Event) -> Result<(), String> {
        let (handle, acknowledged) = match event {
            Event::Acknowledged { message, .. } => (*message, true),
            Event::NotAcknowledged { message, .. } => (*message, false),
            Event::PeerMoved { .. } => {
                self.count("peers moved");
                return Ok(());
            }
            _ => return Ok(()),
        };
        let Some(&number) = self.handles.get(&(life, handle)) else {
            return Err(format!(
                "node {} is told about {handle:?}, never sent",
                life.0
            ));
        };
        self.count(if acknowledged {
            "acknowledged"
        } else {
            "given up"
        });
        let sent = &mut self.sent[number];
        let code = number + 1;
        if !sent.message.acknowledge || sent.result.replace(acknowledged).is_some() {
            return Err(format!("message {code} has a result too many"));
        }
        Ok(())
    }

    /// Checks the outcome of every message once the network is idle. `is_forgetful` tells which
    /// nodes forget fragments for lack of room, `is_reached` which nodes must have received all
    /// their messages.
    pub(crate) fn close(
        &self,
        lives: &[u32],
        is_forgetful: impl Fn(usize) -> bool,
        is_reached: impl Fn(usize) -> bool,
    ) -> Result<(), String> {
        for (number, sent) in self.sent.iter().enumerate() {
            let judged = sent.check_result(lives, &is_forgetful).and_then(|()| {
                let is_calm = number >= self.calm;
                if is_calm {
                    sent.check_fulfilled(&is_reached)
                } else {
                    Ok(())
                }
            });
            judged.map_err(|reason| format!("message {} {reason}", number + 1))?;
        }
        Ok(())
    }
}

impl Sent {
    /// Checks that the sender knows the result, and that the result is true. A component may read
    /// an acknowledged message later, so this is checked at the end.
    fn check_result(
        &self,
        lives: &[u32],
        is_forgetful: impl Fn(usize) -> bool,
    ) -> Result<(), String> {
        let has_ended = |(node, life): Life| lives[node] != life;
        match self.result {
            None if self.message.acknowledge && !has_ended(self.by) => {
                Err(format!("of {:?} has no result", self.at))
            }
            Some(true) if !self.is_at_risk => {
                let [receiver] = self.receivers[..] else {
                    return Err("is acknowledged by nobody known".to_owned());
                };
                let (_, life) = receiver;
                let is_there = self.delivered.contains_key(&receiver);
                if is_there || has_ended(life) || is_forgetful(life.0) {
                    Ok(())
                } else {
                    Err("is acknowledged and was not delivered".to_owned())
                }
            }
            _ => Ok(()),
        }
    }

    /// Checks that it was delivered once to each receiver, and acknowledged if requested.
    fn check_fulfilled(&self, is_reached: impl Fn(usize) -> bool) -> Result<(), String> {
        let to = self.message.destination;
        for receiver in self.receivers.iter().filter(|it| is_reached(it.1.0)) {
            let times = self.delivered.get(receiver).map_or(0, |it| it.1);
            if times != 1 {
                let id = receiver.0;
                return Err(format!(
                    "for {to} reached {id} {times} times on a good wire"
                ));
            }
        }
        let mut receivers = self.receivers.iter();
        let is_reached = receivers.all(|it| is_reached(it.1.0));
        if self.message.acknowledge && is_reached && self.result != Some(true) {
            return Err(format!("for {to} is not acknowledged on a good wire"));
        }
        Ok(())
    }
}
