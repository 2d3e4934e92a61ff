//! The signs by which a peer is recognised, and their weights.

use std::fmt;

use super::Peer;

/// An observed behaviour that points to a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Sign {
    /// A fragment of JAUS++'s length that begins with the code of its message.
    RepeatedCode,
    /// Stale octets after the messages of a datagram.
    StaleOctets,
    /// Register Services sent to another subsystem.
    RegistersAcrossSubsystems,
    /// A private service of JAUS++.
    JausPlusPlusService,
    /// All services of the core set have version 1.0.
    OnlyFirstVersions,
    /// The version octet before each message of a TCP stream.
    RepeatedVersion,
    /// Sequence number 0, which peers that begin with 1 skip.
    NumberZero,
    /// All flags set on a message other than an acknowledgement.
    PriorityFault,
    /// A fragment of Junior's length.
    LongFragments,
    /// A message for one component that was broadcast and requests an acknowledgement.
    CallsUnknownIds,
    /// The first message heard has the number 1.
    BeginsWithOne,
    /// Acknowledgements of reserved message types, except those that look like header compression
    /// if the bits are read from the wrong end. It must be provoked.
    MisreadType,
    /// An acknowledgement of a message for an id with a 0. It must be provoked.
    AnswersForZero,
    /// Sequence numbers counted per destination.
    NumbersByDestination,
    /// Queries to all components of one node, as global broadcasts.
    AsksWholeNodes,
    /// A destination that contains a 0.
    ZeroInDestination,
    /// A service of the interoperability profiles.
    IopService,
}

impl Sign {
    /// All signs.
    pub const ALL: [Self; 17] = [
        Self::RepeatedCode,
        Self::StaleOctets,
        Self::RegistersAcrossSubsystems,
        Self::JausPlusPlusService,
        Self::OnlyFirstVersions,
        Self::RepeatedVersion,
        Self::NumberZero,
        Self::PriorityFault,
        Self::LongFragments,
        Self::CallsUnknownIds,
        Self::BeginsWithOne,
        Self::MisreadType,
        Self::AnswersForZero,
        Self::NumbersByDestination,
        Self::AsksWholeNodes,
        Self::ZeroInDestination,
        Self::IopService,
    ];

    /// The peer that it points to.
    #[must_use]
    pub const fn peer(self) -> Peer {
        match self {
            Self::RepeatedCode
            | Self::StaleOctets
            | Self::RegistersAcrossSubsystems
            | Self::JausPlusPlusService
            | Self::OnlyFirstVersions
            | Self::RepeatedVersion
            | Self::NumberZero => Peer::JausPlusPlus,
            Self::PriorityFault
            | Self::LongFragments
            | Self::CallsUnknownIds
            | Self::BeginsWithOne
            | Self::MisreadType => Peer::Junior,
            Self::AnswersForZero => Peer::Jts,
            Self::NumbersByDestination | Self::AsksWholeNodes => Peer::OpenJausSdk,
            Self::ZeroInDestination | Self::IopService => Peer::Iop,
        }
    }

    /// The weight: 4 is sufficient alone, 2 needs another 2, and 1 alone is a guess.
    pub(super) const fn weight(self) -> u8 {
        match self {
            Self::RepeatedCode
            | Self::JausPlusPlusService
            | Self::PriorityFault
            | Self::MisreadType
            | Self::IopService => 4,
            Self::StaleOctets
            | Self::RegistersAcrossSubsystems
            | Self::RepeatedVersion
            | Self::LongFragments
            | Self::AnswersForZero
            | Self::NumbersByDestination
            | Self::AsksWholeNodes
            | Self::ZeroInDestination => 2,
            Self::OnlyFirstVersions
            | Self::NumberZero
            | Self::CallsUnknownIds
            | Self::BeginsWithOne => 1,
        }
    }

    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl fmt::Display for Sign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::RepeatedCode => {
                "each fragment of its large messages starts with the message code and has 1573 \
                 octets"
            }
            Self::StaleOctets => "octets of older datagrams follow its messages",
            Self::RegistersAcrossSubsystems => "it sends Register Services to other subsystems",
            Self::JausPlusPlusService => "it offers a service of urn:jaus:jss:jpp:extras",
            Self::OnlyFirstVersions => "all its core services have version 1.0",
            Self::RepeatedVersion => "it writes the version octet before each message over TCP",
            Self::NumberZero => "one of its messages has the sequence number 0",
            Self::PriorityFault => "one of its messages has all flags set, as with priority 0",
            Self::LongFragments => "the fragments of its large messages have 4079 octets",
            Self::CallsUnknownIds => {
                "it broadcasts a message for one component and requests acknowledgement"
            }
            Self::BeginsWithOne => "the first message received from it has the number 1",
            Self::MisreadType => "it reads message type bits as header compression flags",
            Self::AnswersForZero => "it answers for an id with a 0 in it",
            Self::NumbersByDestination => "it counts sequence numbers per destination",
            Self::AsksWholeNodes => {
                "it queries all components of a node by global broadcast where others query one"
            }
            Self::ZeroInDestination => "it uses 0 as a wildcard in destinations",
            Self::IopService => "it offers a service of the interoperability profiles",
        })
    }
}

/// A set of signs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Signs(u32);

impl Signs {
    /// Adds a sign; returns whether it is new.
    pub(super) fn insert(&mut self, sign: Sign) -> bool {
        let new = self.0 & sign.bit() == 0;
        self.0 |= sign.bit();
        new
    }

    pub(super) const fn has(self, sign: Sign) -> bool {
        self.0 & sign.bit() != 0
    }

    pub(super) fn iter(self) -> impl Iterator<Item = Sign> {
        Sign::ALL.into_iter().filter(move |sign| self.has(*sign))
    }

    /// The total weight for a peer. Signs of Junior also count for a fork of it, if at least one
    /// sign points to that fork alone.
    pub(super) fn weight(self, peer: Peer) -> u8 {
        let of_it = self.iter().filter(|sign| sign.peer() == peer);
        let alone = of_it.map(Sign::weight).sum();
        match peer.fork_of() {
            Some(original) if alone > 0 => alone + self.weight(original),
            _ => alone,
        }
    }
}
