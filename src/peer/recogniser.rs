//! Tells who a peer is by what it sends.

use std::fmt;

use super::habits::{JAUSPP_FRAGMENT, JUNIOR_PAYLOAD};
use super::numbers::Numbers;
use super::sign::Signs;
use super::{LargeStyle, Peer, Sign};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{QueryIdentification, RegisterServices};
use crate::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, Version};

/// The services that only JAUS++ has.
const JAUSPP_SERVICES: &str = "urn:jaus:jss:jpp:extras:";
/// The services of the interoperability profiles.
const IOP_SERVICES: &str = "urn:jaus:jss:iop:";
/// The services of the core set.
const CORE_SERVICES: &str = "urn:jaus:jss:core:";

/// How sure it is who somebody is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Certainty {
    /// Nothing speaks for anybody.
    #[default]
    Unknown,
    /// Something speaks for it that others do too.
    Guess,
    /// Nobody else is known to do that.
    Likely,
    /// Nobody does that by chance, or several things agree.
    Certain,
}

impl fmt::Display for Certainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Unknown => "unknown",
            Self::Guess => "a guess",
            Self::Likely => "likely",
            Self::Certain => "certain",
        })
    }
}

/// Why a peer is taken for somebody.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Reason {
    /// What was seen.
    pub sign: Sign,
}

/// What was seen, and what follows, in words.
impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, as {} does", self.sign, self.sign.peer().title())
    }
}

/// Who a peer is, as far as can be told.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verdict {
    /// Who; [`Peer::Standard`] if nothing speaks for anybody.
    pub peer: Peer,
    /// How sure that is. Only what is certain changes how a peer is treated.
    pub certainty: Certainty,
    /// All that was seen, also what speaks for somebody else.
    pub reasons: Vec<Reason>,
}

/// Tells who one peer is, by what it sends.
///
/// One for each JAUS id. It must be given what that id sends in the order in which it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recogniser {
    signs: Signs,
    /// Who it is for sure.
    certain: Peer,
    begun: bool,
    numbers: Numbers,
    large: Option<Large>,
}

/// A large message of which all fragments so far repeat its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Large {
    code: u16,
    next: u16,
}

impl Recogniser {
    /// One that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a frame, and how many octets of its datagram lie behind the last message; 0 for a
    /// frame of another kind of link.
    ///
    /// Frames that nobody should accept are welcome: they tell a lot.
    pub fn handle_frame(&mut self, frame: &Frame, trailing: usize) {
        if trailing > 0 {
            self.handle_stale_octets();
        }
        if is_priority_fault(frame) {
            self.note(Sign::PriorityFault);
            return;
        }
        if frame.destination.has_zero() {
            self.note(Sign::ZeroInDestination);
        }
        if frame.version != Version::As5669a || frame.flags.acknowledgement().is_answer() {
            return;
        }
        self.handle_number(frame);
        self.handle_addressing(frame);
        match frame.flags.data() {
            DataControl::Single => self.handle_single(frame),
            _ => self.handle_fragment(frame),
        }
    }

    /// Takes note that octets were left behind the last message of a datagram.
    pub fn handle_stale_octets(&mut self) {
        self.note(Sign::StaleOctets);
    }

    /// Takes a frame of it that went to everybody, besides [`handle_frame`](Self::handle_frame).
    pub fn handle_frame_to_all(&mut self, frame: &Frame) {
        if Self::is_unmarked_call(frame) {
            self.note(Sign::CallsUnknownIds);
        }
    }

    /// Whether a frame that went to everybody is for one component, wants an acknowledgement, and
    /// does not say that it went to everybody: a call as fkie's node manager in Python has it.
    #[must_use]
    pub fn is_unmarked_call(frame: &Frame) -> bool {
        frame.destination.is_unicast()
            && frame.flags.acknowledgement() == Acknowledgement::Request
            && frame.flags.broadcast() == Some(Broadcast::None)
    }

    /// Takes the style of a large message that was put together.
    pub fn handle_large(&mut self, style: LargeStyle) {
        if style == LargeStyle::RepeatedCode {
            self.note(Sign::RepeatedCode);
        }
    }

    /// Takes the services that the peer has told of itself: name, major and minor version.
    pub fn handle_services<'a>(&mut self, services: impl IntoIterator<Item = (&'a str, u8, u8)>) {
        let (mut core, mut newer) = (0, 0);
        for (urn, major, minor) in services {
            if urn.starts_with(JAUSPP_SERVICES) {
                self.note(Sign::JausPlusPlusService);
            } else if urn.starts_with(IOP_SERVICES) {
                self.note(Sign::IopService);
            } else if urn.starts_with(CORE_SERVICES) {
                core += 1;
                newer += usize::from((major, minor) != (1, 0));
            }
        }
        if core > 0 && newer == 0 {
            self.note(Sign::OnlyFirstVersions);
        }
    }

    /// Takes note that a version octet stood before a message in the middle of a TCP stream.
    pub fn handle_repeated_version(&mut self) {
        self.note(Sign::RepeatedVersion);
    }

    /// Takes note that of the reserved message types some were acknowledged, and not those that have
    /// one of the two lowest bits.
    pub fn handle_misread_type(&mut self) {
        self.note(Sign::MisreadType);
    }

    /// Takes note that something was acknowledged that was for an id with a 0.
    pub fn handle_answer_for_zero(&mut self) {
        self.note(Sign::AnswersForZero);
    }

    /// Whether version octets stood before its messages in the middle of a TCP stream.
    pub(crate) const fn repeats_version(&self) -> bool {
        self.signs.has(Sign::RepeatedVersion)
    }

    /// Who it is, as far as can be told.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let (peer, certainty) = self.best();
        let reasons = self.signs.iter().map(|sign| Reason { sign }).collect();
        Verdict {
            peer,
            certainty,
            reasons,
        }
    }

    /// Who it is for sure; else [`Peer::Standard`].
    #[must_use]
    pub const fn certain(&self) -> Peer {
        self.certain
    }

    /// Who it is for sure, or else whom it may be taken for where it does little harm if it is
    /// somebody else: Junior is who begins with number 1, and then calls an id that it does not know
    /// or sends fragments of its length. A node of ours may do either, but does not begin with 1.
    #[must_use]
    pub fn presumed(&self) -> Peer {
        let has = |sign| self.signs.has(sign);
        let is_like_junior =
            has(Sign::BeginsWithOne) && (has(Sign::CallsUnknownIds) || has(Sign::LongFragments));
        if self.certain == Peer::Standard && is_like_junior && self.best().0 == Peer::Junior {
            Peer::Junior
        } else {
            self.certain
        }
    }

    /// For whom most speaks, and how much; of equals the first.
    fn best(&self) -> (Peer, Certainty) {
        let mut best = (Peer::Standard, 0);
        for peer in Peer::ALL {
            let weight = self.signs.weight(peer);
            if weight > best.1 {
                best = (peer, weight);
            }
        }
        let certainty = match best.1 {
            0 => Certainty::Unknown,
            1 => Certainty::Guess,
            2..=3 => Certainty::Likely,
            _ => Certainty::Certain,
        };
        (best.0, certainty)
    }

    fn note(&mut self, sign: Sign) {
        if self.signs.insert(sign)
            && let (peer, Certainty::Certain) = self.best()
        {
            self.certain = peer;
        }
    }

    fn handle_number(&mut self, frame: &Frame) {
        match frame.sequence {
            0 => self.note(Sign::NumberZero),
            1 if !self.begun => self.note(Sign::BeginsWithOne),
            _ => {}
        }
        self.begun = true;
        if self.numbers.handle(frame.destination, frame.sequence) {
            self.note(Sign::NumbersByDestination);
        }
    }

    fn handle_addressing(&mut self, frame: &Frame) {
        if frame.flags.broadcast() != Some(Broadcast::Global) {
            return;
        }
        let destination = frame.destination;
        let asks = frame.flags.acknowledgement() == Acknowledgement::Request;
        if asks && destination.is_unicast() {
            self.note(Sign::CallsUnknownIds);
        }
        let one_node = destination == destination.whole_node()
            && destination.subsystem() != JausId::ANY_SUBSYSTEM
            && destination.node() != JausId::ANY_NODE;
        // Whoever looks for others may well call one node alone.
        if one_node && frame.code() != Some(QueryIdentification::CODE) {
            self.note(Sign::AsksWholeNodes);
        }
    }

    fn handle_single(&mut self, frame: &Frame) {
        if frame.code() != Some(RegisterServices::CODE) {
            return;
        }
        let Ok(registration) = RegisterServices::decode(&frame.payload) else {
            return;
        };
        let subsystem = frame.destination.subsystem();
        if ![frame.source.subsystem(), JausId::ANY_SUBSYSTEM].contains(&subsystem) {
            self.note(Sign::RegistersAcrossSubsystems);
        }
        let services: Vec<_> = registration
            .service_list
            .iter()
            .map(|it| {
                let urn = it.uri.to_string_lossy().into_owned();
                (urn, it.major_version_number, it.minor_version_number)
            })
            .collect();
        let services = services.iter();
        self.handle_services(services.map(|(urn, major, minor)| (urn.as_str(), *major, *minor)));
    }

    /// JAUS++ is known by the length of its fragments but for the last, and by the code in all of
    /// them. One that comes out of order is no evidence.
    fn handle_fragment(&mut self, frame: &Frame) {
        let (data, length) = (frame.flags.data(), frame.payload.len());
        if length == JUNIOR_PAYLOAD && data != DataControl::Last {
            self.note(Sign::LongFragments);
        }
        let before = self.large.take();
        let Some(code) = frame.code() else { return };
        let goes_on = match before {
            _ if data == DataControl::First => true,
            Some(large) => large.code == code && large.next == frame.sequence,
            None => false,
        };
        if !goes_on {
            return;
        }
        if data == DataControl::Last {
            self.note(Sign::RepeatedCode);
        } else if length == JAUSPP_FRAGMENT {
            let next = frame.sequence.wrapping_add(1);
            self.large = Some(Large { code, next });
        }
    }
}

/// Whether this is what Junior makes of a message with priority 0: the flags octet, computed as
/// -1, has all bits set. What it said of broadcast, acknowledgement and fragments is lost with
/// that.
#[must_use]
pub(crate) fn is_priority_fault(frame: &Frame) -> bool {
    frame.version == Version::As5669a && frame.flags == Flags(0xFF) && !frame.payload.is_empty()
}
