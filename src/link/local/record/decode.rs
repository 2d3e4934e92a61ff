//! Octets to records.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddrV6};

use bytes::Bytes;

use super::super::Body;
use super::{
    Delivery, Hello, MAGIC, Reason, RecordError, Refusal, Reply, Request, Send, Want, Welcome, cut,
    kind, place,
};
use crate::address::JausId;
use crate::endpoint::{LinkId, Path, Remote, Unacknowledged};
use crate::wire::{Broadcast, Priority};

impl Request {
    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`] says what cannot be read.
    pub fn decode(body: &Body<'_>) -> Result<Self, RecordError> {
        let mut fields = Fields::new(body)?;
        let request = match fields.kind {
            kind::SEND => Self::Send(fields.send()?),
            kind::HELLO => Self::Hello(fields.hello()?),
            kind::LEAVE => Self::Leave,
            kind => return Err(RecordError::Kind(kind)),
        };
        fields.end()?;
        Ok(request)
    }
}

impl Reply {
    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`] says what cannot be read.
    pub fn decode(body: &Body<'_>) -> Result<Self, RecordError> {
        let mut fields = Fields::new(body)?;
        let reply = match fields.kind {
            kind::DELIVER => Self::Deliver(fields.delivery()?),
            kind::WELCOME => Self::Welcome(Welcome {
                id: fields.id()?,
                max_message: fields.u32()?,
            }),
            kind::REFUSED => Self::Refused(Refusal {
                reason: Reason::from_code(fields.u8()?),
                words: fields.words(),
            }),
            kind::ACKNOWLEDGED => Self::Acknowledged {
                handle: fields.u64()?,
                by: fields.id()?,
            },
            kind::NOT_ACKNOWLEDGED => Self::NotAcknowledged {
                handle: fields.u64()?,
                destination: fields.id()?,
                reason: fields.unacknowledged()?,
                acknowledged: fields.u32()?,
                length: fields.u32()?,
            },
            kind::REJECTED => Self::Rejected {
                handle: fields.u64()?,
                words: fields.words(),
            },
            kind => return Err(RecordError::Kind(kind)),
        };
        fields.end()?;
        Ok(reply)
    }
}

impl Reason {
    const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::Version,
            2 => Self::Taken,
            3 => Self::WrongId,
            4 => Self::TooMany,
            5 => Self::Stopping,
            code => Self::Other(code),
        }
    }
}

/// The fields of a record that are not read yet.
struct Fields<'a> {
    kind: u8,
    body: &'a Body<'a>,
    at: usize,
}

impl<'a> Fields<'a> {
    fn new(body: &'a Body<'a>) -> Result<Self, RecordError> {
        let kind = body.octets().first();
        let &kind = kind.ok_or(RecordError::Length { kind: 0, length: 0 })?;
        Ok(Self { kind, body, at: 1 })
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let rest = self.body.octets().get(self.at..);
        let field = rest.and_then(|rest| rest.first_chunk());
        self.at += N;
        field.copied().ok_or_else(|| self.wrong_length())
    }

    fn u8(&mut self) -> Result<u8, RecordError> {
        self.array::<1>().map(|[octet]| octet)
    }

    fn u16(&mut self) -> Result<u16, RecordError> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, RecordError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, RecordError> {
        self.array().map(u64::from_le_bytes)
    }

    fn id(&mut self) -> Result<JausId, RecordError> {
        self.u32().map(JausId::from_u32)
    }

    /// All that is left.
    fn payload(&mut self) -> Bytes {
        let at = std::mem::replace(&mut self.at, self.body.octets().len());
        self.body.payload(at)
    }

    /// All that is left, up to 255 octets of it, as text that can be shown on any terminal.
    fn words(&mut self) -> String {
        let at = std::mem::replace(&mut self.at, self.body.octets().len());
        let rest = self.body.octets().get(at..).unwrap_or_default();
        let shown = |c: char| {
            if c.is_control() {
                char::REPLACEMENT_CHARACTER
            } else {
                c
            }
        };
        let words = String::from_utf8_lossy(&rest[..rest.len().min(255)]);
        cut(&words.chars().map(shown).collect::<String>()).to_owned()
    }

    fn flags(&mut self, rest: u8) -> Result<(Priority, Broadcast, u8), RecordError> {
        let flags = self.u8()?;
        let wrong = RecordError::Value {
            kind: self.kind,
            value: flags,
        };
        let priority = Priority::ALL[usize::from(flags & 3)];
        let broadcast = match flags >> 2 & 3 {
            0 => Broadcast::None,
            1 => Broadcast::Local,
            2 => Broadcast::Global,
            _ => return Err(wrong),
        };
        match flags >> 4 {
            other if other > rest => Err(wrong),
            other => Ok((priority, broadcast, other)),
        }
    }

    fn unacknowledged(&mut self) -> Result<Unacknowledged, RecordError> {
        match self.u8()? {
            1 => Ok(Unacknowledged::TimedOut),
            2 => Ok(Unacknowledged::Refused),
            3 => Ok(Unacknowledged::NotSent),
            value => {
                let kind = self.kind;
                Err(RecordError::Value { kind, value })
            }
        }
    }

    fn hello(&mut self) -> Result<Hello, RecordError> {
        if self.array()? != MAGIC {
            return Err(RecordError::Stranger);
        }
        let version = self.u8()?;
        let want = match self.u8()? {
            0 => Want::Component(self.u8()?),
            1 => Want::Id(self.id()?),
            value => {
                let kind = self.kind;
                return Err(RecordError::Value { kind, value });
            }
        };
        let name = self.words();
        Ok(Hello {
            version,
            want,
            name,
        })
    }

    fn send(&mut self) -> Result<Send, RecordError> {
        let (priority, broadcast, acknowledge) = self.flags(1)?;
        Ok(Send {
            priority,
            broadcast,
            acknowledge: acknowledge == 1,
            handle: self.u64()?,
            destination: self.id()?,
            payload: self.payload(),
        })
    }

    fn delivery(&mut self) -> Result<Delivery, RecordError> {
        let (priority, broadcast, place) = self.flags(place::IPV6)?;
        Ok(Delivery {
            priority,
            broadcast,
            source: self.id()?,
            destination: self.id()?,
            path: self.path(place)?,
            payload: self.payload(),
        })
    }

    fn path(&mut self, place: u8) -> Result<Option<Path>, RecordError> {
        if place == place::NOWHERE {
            return Ok(None);
        }
        let link = LinkId(self.u16()?);
        let peer = match place {
            place::LINE => Remote::Line,
            place::IPV4 => {
                let ip = Ipv4Addr::from(self.array::<4>()?);
                Remote::Socket((ip, self.u16()?).into())
            }
            _ => {
                let ip = Ipv6Addr::from(self.array::<16>()?);
                let (port, scope) = (self.u16()?, self.u32()?);
                Remote::Socket(SocketAddrV6::new(ip, port, 0, scope).into())
            }
        };
        Ok(Some(Path { link, peer }))
    }

    /// Nothing may be left.
    fn end(&self) -> Result<(), RecordError> {
        let whole = self.at == self.body.octets().len();
        whole.then_some(()).ok_or_else(|| self.wrong_length())
    }

    fn wrong_length(&self) -> RecordError {
        RecordError::Length {
            kind: self.kind,
            length: self.body.octets().len(),
        }
    }
}
