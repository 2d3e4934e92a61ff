//! One whole message of the Reference Architecture.

use std::fmt;

use bytes::Bytes;

use super::RaId;
use jaus::codec;
use jaus::wire::ra::CODE_LEN;

/// One whole message, put together if it came in parts.
#[derive(Clone, PartialEq, Eq)]
pub struct Message {
    /// For whom; 255 in a field stands for all.
    pub destination: RaId,
    /// From whom: always one component.
    pub source: RaId,
    /// What it is: the message (command) code.
    pub code: u16,
    /// What follows the header.
    pub data: Bytes,
    /// 0 ..= 15; 6 is the ordinary one.
    pub priority: u8,
    /// Whether the receiver is to acknowledge it.
    pub acknowledge: bool,
    /// Whether it belongs to a service connection.
    pub connection: bool,
    /// Whether its code is one of those that systems agree upon among themselves.
    pub experimental: bool,
    /// The number that its sender gave it: of a large message that of the last part to come. Most
    /// systems leave it at 0 but in service connections.
    pub sequence: u16,
}

impl Message {
    /// The priority of ordinary messages.
    pub const ORDINARY: u8 = 6;

    /// An ordinary message, which nobody has to acknowledge.
    #[must_use]
    pub const fn new(source: RaId, destination: RaId, code: u16, data: Bytes) -> Self {
        Self {
            destination,
            source,
            code,
            data,
            priority: Self::ORDINARY,
            acknowledge: false,
            connection: false,
            experimental: false,
            sequence: 0,
        }
    }

    /// An ordinary message with this body.
    ///
    /// # Errors
    /// A body outside the limits of its definition.
    pub fn with_body<M: codec::Message>(
        source: RaId,
        destination: RaId,
        body: &M,
    ) -> Result<Self, codec::EncodeError> {
        let data = body.encode()?.slice(CODE_LEN..);
        Ok(Self::new(source, destination, M::CODE, data))
    }

    /// The body, if it is one of that type.
    ///
    /// # Errors
    /// Another code, or data that is none of its type.
    pub fn body<M: codec::Message>(&self) -> Result<M, codec::DecodeError> {
        M::decode(&self.payload())
    }

    /// Code and data in one, as all our codecs have it.
    #[must_use]
    pub fn payload(&self) -> Bytes {
        let mut payload = Vec::with_capacity(CODE_LEN + self.data.len());
        payload.extend_from_slice(&self.code.to_le_bytes());
        payload.extend_from_slice(&self.data);
        payload.into()
    }

    /// An answer to this message: from the id that was addressed, to the one that asked.
    #[must_use]
    pub const fn answer(&self, code: u16, data: Bytes) -> Self {
        let mut answer = Self::new(self.destination, self.source, code, data);
        answer.priority = self.priority;
        answer
    }
}

impl fmt::Debug for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:04X}h {} -> {} ({} octets, priority {}",
            self.code,
            self.source,
            self.destination,
            self.data.len(),
            self.priority,
        )?;
        for (set, name) in [
            (self.acknowledge, ", acknowledge"),
            (self.connection, ", connection"),
            (self.experimental, ", experimental"),
        ] {
            if set {
                f.write_str(name)?;
            }
        }
        f.write_str(")")
    }
}
