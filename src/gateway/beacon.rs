//! The gateway's own state, as RA components want to know it: those that are controlled connect to
//! the status of their controller, and stand still unless it says that it is ready.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::{BufMut, Bytes, BytesMut};

use super::front::{connection, leading_code, rate};
use crate::ra::{Message, RaId};

/// Report Component Status.
const STATUS: u16 = 0x4002;
/// Query Component Status.
const QUERY_STATUS: u16 = 0x2002;

/// Those who are told our state.
#[derive(Debug, Default)]
pub(super) struct Beacon {
    told: BTreeMap<RaId, Told>,
    said: Vec<Message>,
}

#[derive(Debug)]
struct Told {
    request: Message,
    period: Duration,
    next: Instant,
}

impl Beacon {
    /// The most that are told.
    const MOST: usize = 256;
    /// The fastest rate in hertz.
    const FASTEST: f64 = 20.0;

    /// A message for the gateway itself; says whether it was one that belongs here.
    pub(super) fn handle_message(&mut self, now: Instant, message: &Message) -> bool {
        match message.code {
            QUERY_STATUS => self.said.push(message.answer(STATUS, ready())),
            0x0008 => self.connect(now, message),
            0x000A | 0x000B => {}
            0x000C if leading_code(&message.data) == Some(STATUS) => {
                self.told.remove(&message.source);
            }
            _ => return false,
        }
        true
    }

    fn connect(&mut self, now: Instant, message: &Message) {
        let Some((report, hz, _)) = connection(&message.data) else {
            return;
        };
        let known = self.told.contains_key(&message.source);
        let has_room = known || self.told.len() < Self::MOST;
        let hz = hz.min(Self::FASTEST);
        let (confirmed, response) = match report {
            STATUS if has_room => (rate(hz), 0),
            STATUS => (0, 2),
            _ => (0, 1),
        };
        let mut body = BytesMut::new();
        body.put_u16_le(report);
        body.put_u8(0);
        body.put_u16_le(confirmed);
        body.put_u8(response);
        let mut confirm = message.answer(0x0009, body.freeze());
        confirm.connection = true;
        self.said.push(confirm);
        if response == 0 {
            let told = Told {
                request: message.clone(),
                period: Duration::from_secs_f64(1.0 / hz),
                next: now,
            };
            self.told.insert(message.source, told);
        }
    }

    /// A subsystem is gone.
    pub(super) fn forget(&mut self, subsystem: u8) {
        self.told.retain(|id, _| id.subsystem != subsystem);
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        for told in self.told.values_mut().filter(|it| it.next <= now) {
            told.next = now + told.period;
            let mut report = told.request.answer(STATUS, ready());
            report.connection = true;
            self.said.push(report);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.told.values().map(|told| told.next).min()
    }

    /// What is to be sent since this was asked last.
    pub(super) fn take_said(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.said)
    }
}

/// Ready, without further words.
fn ready() -> Bytes {
    Bytes::from_static(&[1, 0, 0, 0, 0])
}
