//! A complete message of the Reference Architecture.

use std::fmt;

use bytes::Bytes;

use jaus::codec;
use jaus::wire::ra::{CODE_LEN, RaId};

/// A complete message, reassembled if it arrived in parts.
///
/// ```
/// use bytes::Bytes;
/// use jaus::messages::core::QueryHeartbeatPulse;
/// use jaus_ra::{Message, RaId};
///
/// let (ours, theirs): (RaId, RaId) = ("32.1.32.1".parse()?, "20.1.33.1".parse()?);
/// let query = Message::new(ours, theirs, 0x2202, Bytes::new());
/// assert_eq!(query.body::<QueryHeartbeatPulse>()?, QueryHeartbeatPulse);
/// assert_eq!(query.answer(0x4202, Bytes::new()).destination, ours);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Message {
    /// Destination; 255 in a field addresses all.
    pub destination: RaId,
    /// Source: always a single component.
    pub source: RaId,
    /// The message (command) code.
    pub code: u16,
    /// Data after the header.
    pub data: Bytes,
    /// 0 ..= 15; the default is 6.
    pub priority: u8,
    /// Whether the sender requests an acknowledgement.
    pub acknowledge: bool,
    /// Whether it belongs to a service connection.
    pub connection: bool,
    /// Whether its code is experimental, defined by agreement between systems.
    pub experimental: bool,
    /// Sequence number set by the sender; for a large message, that of the last part to arrive.
    /// Most systems use 0 except in service connections.
    pub sequence: u16,
}

impl Message {
    /// Default priority.
    pub const ORDINARY: u8 = 6;

    /// A message with default priority and without acknowledgement.
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

    /// A message with default priority and this body.
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

    /// Decodes the body as type `M`.
    ///
    /// # Errors
    /// A different code, or data that does not decode.
    pub fn body<M: codec::Message>(&self) -> Result<M, codec::DecodeError> {
        M::decode(&self.payload())
    }

    /// Code and data in one payload, as our codecs expect it.
    #[must_use]
    pub fn payload(&self) -> Bytes {
        let mut payload = Vec::with_capacity(CODE_LEN + self.data.len());
        payload.extend_from_slice(&self.code.to_le_bytes());
        payload.extend_from_slice(&self.data);
        payload.into()
    }

    /// A reply to this message: from the addressed id to the sender.
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
