//! Records to octets.

use std::net::{IpAddr, SocketAddr};

use bytes::{BufMut, Bytes};

use super::{Delivery, Hello, LENGTH, MAGIC, Reason, Reply, Request, Send, Want, cut, kind, place};
use crate::endpoint::{Remote, Unacknowledged};
use crate::wire::{Broadcast, Priority};

impl Request {
    /// Writes the record, all but the payload of a [`Send`](Self::Send), which follows as it is and
    /// which this returns.
    pub fn encode_head(&self, to: &mut Vec<u8>) -> Option<&Bytes> {
        match self {
            Self::Hello(hello) => write(to, kind::HELLO, 0, |to| put_hello(to, hello)),
            Self::Send(send) => {
                let length = send.payload.len();
                write(to, kind::SEND, length, |to| put_send(to, send));
                return Some(&send.payload);
            }
            Self::Leave => write(to, kind::LEAVE, 0, |_| {}),
        }
        None
    }
}

impl Reply {
    /// Writes the record, all but the payload of a [`Deliver`](Self::Deliver), which follows as it
    /// is and which this returns.
    pub fn encode_head(&self, to: &mut Vec<u8>) -> Option<&Bytes> {
        match self {
            Self::Deliver(delivery) => {
                let length = delivery.payload.len();
                write(to, kind::DELIVER, length, |to| put_delivery(to, delivery));
                return Some(&delivery.payload);
            }
            Self::Welcome(welcome) => write(to, kind::WELCOME, 0, |to| {
                to.put_u32_le(welcome.id.to_u32());
                to.put_u32_le(welcome.max_message);
            }),
            Self::Refused(refusal) => write(to, kind::REFUSED, 0, |to| {
                to.put_u8(refusal.reason.code());
                put_words(to, &refusal.words);
            }),
            Self::Acknowledged { handle, by } => write(to, kind::ACKNOWLEDGED, 0, |to| {
                to.put_u64_le(*handle);
                to.put_u32_le(by.to_u32());
            }),
            Self::NotAcknowledged {
                handle,
                destination,
                reason,
                acknowledged,
                length,
            } => write(to, kind::NOT_ACKNOWLEDGED, 0, |to| {
                to.put_u64_le(*handle);
                to.put_u32_le(destination.to_u32());
                to.put_u8(unacknowledged_code(*reason));
                to.put_u32_le(*acknowledged);
                to.put_u32_le(*length);
            }),
            Self::Rejected { handle, words } => write(to, kind::REJECTED, 0, |to| {
                to.put_u64_le(*handle);
                put_words(to, words);
            }),
        }
        None
    }
}

impl Reason {
    const fn code(self) -> u8 {
        match self {
            Self::Version => 1,
            Self::Taken => 2,
            Self::WrongId => 3,
            Self::TooMany => 4,
            Self::Stopping => 5,
            Self::Other(code) => code,
        }
    }
}

const fn unacknowledged_code(reason: Unacknowledged) -> u8 {
    match reason {
        Unacknowledged::TimedOut => 1,
        Unacknowledged::Refused => 2,
        Unacknowledged::NotSent => 3,
    }
}

/// Writes length, kind and what `body` writes; `payload` octets will follow.
fn write(to: &mut Vec<u8>, kind: u8, payload: usize, body: impl FnOnce(&mut Vec<u8>)) {
    let start = to.len();
    to.extend_from_slice(&[0; LENGTH]);
    to.push(kind);
    body(to);
    // Payloads are bounded where they are sent; what could not be is cut short nowhere else.
    let length = u32::try_from(to.len() - start - LENGTH + payload).unwrap_or(u32::MAX);
    if let Some(head) = to.get_mut(start..start + LENGTH) {
        head.copy_from_slice(&length.to_le_bytes());
    }
}

fn put_hello(to: &mut Vec<u8>, hello: &Hello) {
    to.extend_from_slice(&MAGIC);
    to.push(hello.version);
    match hello.want {
        Want::Component(number) => to.extend_from_slice(&[0, number]),
        Want::Id(id) => {
            to.push(1);
            to.put_u32_le(id.to_u32());
        }
    }
    put_words(to, &hello.name);
}

fn put_send(to: &mut Vec<u8>, send: &Send) {
    let acknowledge = u8::from(send.acknowledge) << 4;
    to.push(flags(send.priority, send.broadcast) | acknowledge);
    to.put_u64_le(send.handle);
    to.put_u32_le(send.destination.to_u32());
}

fn put_delivery(to: &mut Vec<u8>, delivery: &Delivery) {
    let place = match delivery.path.map(|path| path.peer) {
        None => place::NOWHERE,
        Some(Remote::Line) => place::LINE,
        Some(Remote::Socket(SocketAddr::V4(_))) => place::IPV4,
        Some(Remote::Socket(SocketAddr::V6(_))) => place::IPV6,
    };
    to.push(flags(delivery.priority, delivery.broadcast) | place << 4);
    to.put_u32_le(delivery.source.to_u32());
    to.put_u32_le(delivery.destination.to_u32());
    let Some(path) = delivery.path else { return };
    to.put_u16_le(path.link.0);
    let Remote::Socket(address) = path.peer else {
        return;
    };
    match address.ip() {
        IpAddr::V4(ip) => to.extend_from_slice(&ip.octets()),
        IpAddr::V6(ip) => to.extend_from_slice(&ip.octets()),
    }
    to.put_u16_le(address.port());
    if let SocketAddr::V6(address) = address {
        to.put_u32_le(address.scope_id());
    }
}

fn put_words(to: &mut Vec<u8>, words: &str) {
    to.extend_from_slice(cut(words).as_bytes());
}

const fn flags(priority: Priority, broadcast: Broadcast) -> u8 {
    priority.bits() | (broadcast as u8) << 2
}
