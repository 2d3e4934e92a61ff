//! The behaviour that depends on a known peer: limits, rates and wire variants.

use super::Implementation;
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::UpdateEvent;

/// How a sender cuts large messages for AS5669A.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LargeStyle {
    /// The message is cut as it is; only the first fragment begins with its code. The standard and
    /// Junior do this.
    #[default]
    Standard,
    /// Each fragment begins with the message code. JAUS++ does this, and accepts nothing else.
    RepeatedCode,
}

/// How fast a receiver empties its receive buffer, in octets that datagrams occupy there. It limits
/// the rate of fragments of unacknowledged large messages to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Pacing {
    /// Octets that may be filled at once.
    pub burst: usize,
    /// Octets assumed to be emptied per second.
    pub rate: u64,
}

impl Implementation {
    /// How it cuts large messages and expects them to be cut; `None` if unknown.
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

    /// The longest payload, in octets, that it accepts in one packet, if less than the transport
    /// allows.
    #[must_use]
    pub const fn payload_limit(self) -> Option<usize> {
        match self {
            // It expects longer messages in fragments.
            Self::JausPlusPlus => Some(JAUSPP_PAYLOAD),
            // Its largest MTU_Size.
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_PAYLOAD),
            Self::Standard | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// The most fragments that it keeps, over all unfinished messages together, if a large message
    /// can have more. Beyond that it drops the oldest fragment for each new one, yet acknowledges
    /// all.
    #[must_use]
    pub const fn fragments_kept(self) -> Option<usize> {
        match self {
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_FRAGMENTS),
            Self::Standard | Self::JausPlusPlus | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// How fast it takes in large messages, in its default configuration, if slower than other
    /// peers.
    #[must_use]
    pub const fn intake(self) -> Option<Pacing> {
        match self {
            Self::JausPlusPlus => Some(JAUSPP_INTAKE),
            Self::Junior | Self::Jts | Self::Fkie => Some(JUNIOR_INTAKE),
            Self::Standard | Self::OpenJausSdk | Self::Iop => None,
        }
    }

    /// Whether it retransmits within half a second or not at all. A later repetition comes from a
    /// restarted process, which begins with the same numbers.
    #[must_use]
    pub const fn repeats_soon(self) -> bool {
        matches!(self, Self::Junior | Self::Jts | Self::Fkie)
    }

    /// Whether a 0 in its destinations is a wildcard, as 65535 and 255 are for other peers.
    #[must_use]
    pub const fn reads_zero_as_wildcard(self) -> bool {
        matches!(self, Self::Iop | Self::Jts)
    }

    /// Whether its process ends when it receives a message with this code.
    #[must_use]
    pub const fn crashes_on(self, code: u16) -> bool {
        matches!(self, Self::JausPlusPlus) && code == UpdateEvent::CODE
    }

    /// Whether answers on the TCP connections that it opened are lost, so that answers must go by
    /// UDP.
    #[must_use]
    pub const fn is_deaf_on_its_connections(self) -> bool {
        matches!(self, Self::JausPlusPlus)
    }

    /// Whether it confuses these two components, and delivers messages for one to the other.
    ///
    /// ```
    /// use jaus::address::JausId;
    /// use jaus::peer::Implementation;
    ///
    /// let (one, other) = (JausId::new(1, 1, 1), JausId::new(513, 1, 1));
    /// assert!(Implementation::Jts.confuses(one, other) && !Implementation::Junior.confuses(one, other));
    /// ```
    #[must_use]
    pub fn confuses(self, one: JausId, other: JausId) -> bool {
        // It compares octet by octet, with 0 and 255 matching any.
        let is_any = |octet| [0, 0xFF].contains(&octet);
        let mut octets = one.to_wire().into_iter().zip(other.to_wire());
        let are_same = octets.all(|(a, b)| a == b || is_any(a) || is_any(b));
        self == Self::Jts && one != other && are_same
    }
}

/// The payload of each JAUS++ fragment except the last, in octets: the code and 1571 more.
pub(crate) const JAUSPP_FRAGMENT: usize = 1573;
/// The longest payload that JAUS++ sends unfragmented, in octets.
const JAUSPP_PAYLOAD: usize = 1425;
/// JAUS++ reads one datagram and sleeps for a millisecond, then for another before its component
/// gets it: at most some 900 datagrams per second, each occupying 2304 octets for one of its
/// fragments. Two thirds of that leave it time for other senders.
const JAUSPP_INTAKE: Pacing = Pacing {
    burst: 64_000,
    rate: 1_400_000,
};
/// The payload of each Junior fragment except the last, in octets, unless `MTU_Size` is set lower.
pub(crate) const JUNIOR_PAYLOAD: usize = 4079;
/// The fragments that Junior keeps with its default `MaxMsgHistory`.
const JUNIOR_FRAGMENTS: usize = 50;
/// Measured with Junior: its 140000 octets must hold everything that arrives while its run-time
/// engine sleeps, and that engine passes ten datagrams per turn to an application.
const JUNIOR_INTAKE: Pacing = Pacing {
    burst: 64_000,
    rate: 10_000_000,
};
