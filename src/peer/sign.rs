//! The signs by which a peer is recognised, and their weights.

use std::fmt;

use super::Implementation;

/// Defines the signs. Each has the peer that it points to, its weight, and its description.
macro_rules! signs {
    ($($(#[doc = $doc:literal])+ $sign:ident = $peer:ident, $weight:literal: $words:literal;)+) => {
        /// An observed behaviour that points to a peer.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum Sign {
            $($(#[doc = $doc])+ $sign,)+
        }

        impl Sign {
            /// All signs.
            pub const ALL: &[Self] = &[$(Self::$sign,)+];

            /// The peer that it points to.
            #[must_use]
            pub const fn peer(self) -> Implementation {
                match self {
                    $(Self::$sign => Implementation::$peer,)+
                }
            }

            /// The weight: 4 is sufficient alone, 2 needs another 2, and 1 alone is a guess.
            const fn weight(self) -> u8 {
                match self {
                    $(Self::$sign => $weight,)+
                }
            }
        }

        impl fmt::Display for Sign {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Self::$sign => $words,)+
                })
            }
        }
    };
}

signs! {
    /// A fragment of JAUS++'s length that begins with the code of its message.
    RepeatedCode = JausPlusPlus, 4:
        "each fragment of its large messages starts with the message code and has 1573 octets";
    /// Stale octets after the messages of a datagram.
    StaleOctets = JausPlusPlus, 2: "octets of older datagrams follow its messages";
    /// Register Services sent to another subsystem.
    RegistersAcrossSubsystems = JausPlusPlus, 2: "it sends Register Services to other subsystems";
    /// A private service of JAUS++.
    JausPlusPlusService = JausPlusPlus, 4: "it offers a service of urn:jaus:jss:jpp:extras";
    /// All services of the core set have version 1.0.
    OnlyFirstVersions = JausPlusPlus, 1: "all its core services have version 1.0";
    /// The version octet before each message of a TCP stream.
    RepeatedVersion = JausPlusPlus, 2: "it writes the version octet before each message over TCP";
    /// Sequence number 0, which peers that begin with 1 skip.
    NumberZero = JausPlusPlus, 1: "one of its messages has the sequence number 0";
    /// All flags set on a message other than an acknowledgement.
    PriorityFault = Junior, 4: "one of its messages has all flags set, as with priority 0";
    /// A fragment of Junior's length.
    LongFragments = Junior, 2: "the fragments of its large messages have 4079 octets";
    /// A message for one component that was broadcast and requests an acknowledgement.
    CallsUnknownIds = Junior, 1:
        "it broadcasts a message for one component and requests acknowledgement";
    /// The first message heard has the number 1.
    BeginsWithOne = Junior, 1: "the first message received from it has the number 1";
    /// Acknowledgements of reserved message types, except those that look like header compression
    /// if the bits are read from the wrong end. It must be provoked.
    MisreadType = Junior, 4: "it reads message type bits as header compression flags";
    /// An acknowledgement of a message for an id with a 0. It must be provoked.
    AnswersForZero = Jts, 2: "it answers for an id with a 0 in it";
    /// Sequence numbers counted per destination.
    NumbersByDestination = OpenJausSdk, 2: "it counts sequence numbers per destination";
    /// Queries to all components of one node, as global broadcasts.
    AsksWholeNodes = OpenJausSdk, 2:
        "it queries all components of a node by global broadcast where others query one";
    /// A destination that contains a 0.
    ZeroInDestination = Iop, 2: "it uses 0 as a wildcard in destinations";
    /// A service of the interoperability profiles.
    IopService = Iop, 4: "it offers a service of the interoperability profiles";
}

impl Sign {
    /// It and the peer that it points to, in words.
    #[must_use]
    pub fn explanation(self) -> String {
        format!("{self}, as {} does", self.peer().title())
    }
}

/// A set of signs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Signs(u32);

impl Signs {
    /// Adds a sign; returns whether it is new.
    pub(super) fn insert(&mut self, sign: Sign) -> bool {
        let new = !self.has(sign);
        self.0 |= 1 << sign as u32;
        new
    }

    pub(super) const fn has(self, sign: Sign) -> bool {
        self.0 & (1 << sign as u32) != 0
    }

    pub(super) fn iter(self) -> impl Iterator<Item = Sign> {
        Sign::ALL
            .iter()
            .copied()
            .filter(move |&sign| self.has(sign))
    }

    /// Whether a sign is evidence. Nodes of this implementation show some signs too: they call
    /// unknown ids, may send fragments of Junior's length, query whole nodes, and seem to count per
    /// destination if messages overtake each other. But they do not begin with number 1, so these
    /// signs count only for a peer that does. They also offer services of the interoperability
    /// profiles, but write no 0 in destinations.
    const fn is_evidence(self, sign: Sign) -> bool {
        match sign {
            Sign::LongFragments
            | Sign::CallsUnknownIds
            | Sign::NumbersByDestination
            | Sign::AsksWholeNodes => self.has(Sign::BeginsWithOne),
            Sign::IopService => self.has(Sign::ZeroInDestination),
            _ => true,
        }
    }

    /// The total weight for a peer. Signs of Junior also count for a fork of it, if at least one
    /// sign points to that fork alone.
    pub(super) fn weight(self, peer: Implementation) -> u8 {
        let is_for_it = |sign: &Sign| sign.peer() == peer && self.is_evidence(*sign);
        let of_it = self.iter().filter(is_for_it);
        let alone = of_it.map(Sign::weight).sum();
        match peer.fork_of() {
            Some(original) if alone > 0 => alone + self.weight(original),
            _ => alone,
        }
    }
}
