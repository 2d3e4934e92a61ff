//! What is done otherwise for a peer that is known.

use super::Peer;
use crate::address::JausId;

/// How large messages are cut for AS5669A, by the sender's habit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LargeStyle {
    /// The message is cut as it is; only the first fragment begins with its code. So do the
    /// standard and Junior.
    #[default]
    Standard,
    /// Each fragment begins with the message code. So does JAUS++, and it understands nothing else.
    RepeatedCode,
}

/// How fast a receiver empties its receive buffer, in octets of what datagrams occupy there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Intake {
    /// What it may be given at once, in octets.
    pub burst: usize,
    /// What it empties, in octets each second.
    pub rate: u64,
}

impl Peer {
    /// How it cuts large messages and wants them cut; `None` for somebody of whom that is not
    /// known.
    #[must_use]
    pub const fn large_style(self) -> Option<LargeStyle> {
        match self {
            Self::Standard => None,
            Self::JausPlusPlus => Some(LargeStyle::RepeatedCode),
            Self::Junior | Self::Jts | Self::Fkie | Self::OpenJausSdk | Self::Iop => {
                Some(LargeStyle::Standard)
            }
        }
    }

    /// The longest payload, in octets, that it takes in one packet, if that is less than the
    /// transport allows.
    #[must_use]
    pub const fn payload_limit(self) -> Option<usize> {
        match self {
            // What is longer it expects in fragments.
            Self::JausPlusPlus => Some(JAUSPP_PAYLOAD),
            // Its largest MTU_Size.
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_PAYLOAD),
            Self::Standard | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// The most fragments that it keeps, of all messages that are not whole together, if that is
    /// less than those of a large message can be. It forgets the oldest for a new one, and
    /// acknowledges each.
    #[must_use]
    pub const fn fragments_kept(self) -> Option<usize> {
        match self {
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_FRAGMENTS),
            Self::Standard | Self::JausPlusPlus | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// What it takes of a large message at once and in time, as it is shipped, if that is less than
    /// others take.
    #[must_use]
    pub const fn intake(self) -> Option<Intake> {
        match self {
            Self::JausPlusPlus => Some(JAUSPP_INTAKE),
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_INTAKE),
            Self::Standard | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// Whether it sends again within half a second what was not acknowledged, or never. What comes
    /// again later is of a process that was started again, and begins with the same numbers.
    #[must_use]
    pub const fn repeats_soon(self) -> bool {
        matches!(self, Self::Junior | Self::Jts | Self::Fkie)
    }

    /// Whether a 0 in its destinations stands for "all of them", as 65535 and 255 do with others.
    #[must_use]
    pub const fn reads_zero_as_wildcard(self) -> bool {
        matches!(self, Self::Iop | Self::Jts)
    }

    /// Whether answers on the TCP connections that it opened are lost, so that it is to be answered by
    /// UDP.
    #[must_use]
    pub const fn is_deaf_on_its_connections(self) -> bool {
        matches!(self, Self::JausPlusPlus)
    }

    /// Whether it cannot keep two components apart, and delivers to one what is for the other.
    ///
    /// ```
    /// use jaus::address::JausId;
    /// use jaus::peer::Peer;
    ///
    /// let (one, other) = (JausId::new(1, 1, 1), JausId::new(513, 1, 1));
    /// assert!(Peer::Jts.confuses(one, other) && !Peer::Junior.confuses(one, other));
    /// ```
    #[must_use]
    pub fn confuses(self, one: JausId, other: JausId) -> bool {
        self == Self::Jts && one != other && same_octets(one, other)
    }
}

/// Whether two ids are the same octet by octet, with 0 and 255 standing for any.
fn same_octets(one: JausId, other: JausId) -> bool {
    let octets = one.to_wire().into_iter().zip(other.to_wire());
    octets
        .into_iter()
        .all(|(a, b)| a == b || [a, b].iter().any(|it| [0, 0xFF].contains(it)))
}

/// The payload of JAUS++'s fragments but for the last, in octets: the code and 1571 more.
pub(crate) const JAUSPP_FRAGMENT: usize = 1573;
/// The longest payload that JAUS++ sends whole, in octets.
const JAUSPP_PAYLOAD: usize = 1425;
/// JAUS++ reads one datagram and sleeps for a millisecond, then for another one before its component
/// gets it: at most some 900 datagrams in a second, each of 2304 octets for one of its fragments.
/// Two thirds of that leave it time for others.
const JAUSPP_INTAKE: Intake = Intake {
    burst: 64_000,
    rate: 1_400_000,
};
/// The payload of Junior's fragments but for the last, in octets, unless `MTU_Size` is set lower.
pub(crate) const JUNIOR_PAYLOAD: usize = 4079;
/// The fragments that Junior keeps with the `MaxMsgHistory` that it is shipped with.
const JUNIOR_FRAGMENTS: usize = 50;
/// Measured with Junior: its 140000 octets must hold what comes while its run-time engine sleeps,
/// and that hands over to an application ten datagrams in a turn.
const JUNIOR_INTAKE: Intake = Intake {
    burst: 64_000,
    rate: 10_000_000,
};
