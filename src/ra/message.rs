//! One whole message of the Reference Architecture, and what ids may stand in it.

use std::fmt;

use bytes::Bytes;

use super::RaId;
use crate::codec;
use crate::wire::ra::CODE_LEN;

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

/// Why an id may not stand where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BadId {
    /// Zero names nobody.
    #[error("{0} has a field of 0, which names nobody: use 1 to 254")]
    Zero(RaId),
    /// A source, or a message that asks for an answer, is of one component.
    #[error("{0} has a field of 255, which stands for all: name one component with 1 to 254")]
    Wildcard(RaId),
}

/// Whom a destination names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recipients {
    /// One component.
    One,
    /// Several: a field is 255.
    Many,
}

impl RaId {
    /// What stands for all subsystems, nodes, components or instances.
    pub const ALL: u8 = 255;
    /// The component number of a node manager.
    pub const NODE_MANAGER: u8 = 1;
    /// The component number of a communicator.
    pub const COMMUNICATOR: u8 = 35;

    /// The id of these four.
    #[must_use]
    pub const fn new(subsystem: u8, node: u8, component: u8, instance: u8) -> Self {
        Self {
            subsystem,
            node,
            component,
            instance,
        }
    }

    /// Whom it names as a destination.
    ///
    /// # Errors
    /// A field of 0.
    pub fn recipients(self) -> Result<Recipients, BadId> {
        let fields = self.fields();
        match fields {
            _ if fields.contains(&0) => Err(BadId::Zero(self)),
            _ if fields.contains(&Self::ALL) => Ok(Recipients::Many),
            _ => Ok(Recipients::One),
        }
    }

    /// That it names one component, as each source must.
    ///
    /// # Errors
    /// A field of 0 or 255.
    pub fn require_one(self) -> Result<(), BadId> {
        match self.recipients()? {
            Recipients::One => Ok(()),
            Recipients::Many => Err(BadId::Wildcard(self)),
        }
    }

    /// Whether `id`, which names one component, is meant when this stands as the destination.
    #[must_use]
    pub fn includes(self, id: Self) -> bool {
        let meant = |(field, other): (u8, u8)| field == other || field == Self::ALL;
        self.fields().into_iter().zip(id.fields()).all(meant)
    }

    const fn fields(self) -> [u8; 4] {
        [self.subsystem, self.node, self.component, self.instance]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_one_component_and_destinations_may_be_all() {
        let one = RaId::new(10, 1, 35, 1);
        assert_eq!(one.require_one(), Ok(()));
        let all = RaId::new(255, 255, 1, 1);
        assert_eq!(all.recipients(), Ok(Recipients::Many));
        assert_eq!(all.require_one(), Err(BadId::Wildcard(all)));
        let nobody = RaId::new(10, 0, 255, 1);
        assert_eq!(nobody.recipients(), Err(BadId::Zero(nobody)));
        assert!(all.includes(RaId::new(7, 3, 1, 1)));
        assert!(!all.includes(one));
    }
}
