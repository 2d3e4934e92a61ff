//! Recognises which implementation a peer runs by the messages that it sends.

use std::fmt;

use super::habits::{JAUSPP_FRAGMENT, JUNIOR_PAYLOAD};
use super::numbers::Numbers;
use super::sign::Signs;
use super::{Implementation, LargeStyle, Sign};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{QueryIdentification, RegisterServices};
use crate::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, Version};

/// The prefix of services that only JAUS++ offers.
const JAUSPP_SERVICES: &str = "urn:jaus:jss:jpp:extras:";
/// The prefix of services of the interoperability profiles.
const IOP_SERVICES: &str = "urn:jaus:jss:iop:";
/// The prefix of services of the core set.
const CORE_SERVICES: &str = "urn:jaus:jss:core:";

/// How certain a recognition is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Certainty {
    /// There is no evidence.
    #[default]
    Unknown,
    /// The evidence also fits other implementations.
    Guess,
    /// No other implementation is known to do this.
    Likely,
    /// It cannot be chance, or several signs agree.
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

/// The result of a recognition.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Verdict {
    /// The most likely peer; [`Implementation::Standard`] without evidence.
    pub peer: Implementation,
    /// How certain that is. An uncertain result changes how a peer is treated only where a wrong
    /// guess does little harm.
    pub certainty: Certainty,
    /// All observed signs, including those that point to other peers, and those that are no
    /// evidence by themselves.
    pub reasons: Vec<Sign>,
}

/// Recognises one peer by the messages that it sends.
///
/// Use one per JAUS id, and pass it everything from that id in order of arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recogniser {
    signs: Signs,
    /// The peer recognised with certainty.
    certain: Implementation,
    begun: bool,
    numbers: Numbers,
    large: Option<Large>,
}

/// A large message whose fragments have all repeated its code so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Large {
    code: u16,
    next: u16,
}

impl Recogniser {
    /// Processes a frame. `trailing` is the number of octets after the last message of its
    /// datagram; 0 for frames from other kinds of link.
    ///
    /// Pass invalid frames too: they are good evidence.
    pub fn handle_frame(&mut self, frame: &Frame, trailing: usize) {
        if trailing > 0 {
            self.note(Sign::StaleOctets);
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

    /// Records a sign that frames do not show by themselves.
    pub fn note(&mut self, sign: Sign) {
        if self.signs.insert(sign)
            && let (peer, Certainty::Certain) = self.best()
        {
            self.certain = peer;
        }
    }

    /// Processes a frame that was sent to all, in addition to [`handle_frame`](Self::handle_frame).
    pub fn handle_frame_to_all(&mut self, frame: &Frame) {
        if Self::is_unmarked_call(frame) {
            self.note(Sign::CallsUnknownIds);
        }
    }

    /// Whether a frame that was sent to all is for one component, requests an acknowledgement, and
    /// does not carry the broadcast flag: the call of fkie's node manager in Python.
    #[must_use]
    pub fn is_unmarked_call(frame: &Frame) -> bool {
        frame.destination.is_unicast()
            && frame.flags.acknowledgement() == Acknowledgement::Request
            && frame.flags.broadcast() == Some(Broadcast::None)
    }

    /// Records the style of a reassembled large message.
    pub fn handle_large(&mut self, style: LargeStyle) {
        if style == LargeStyle::RepeatedCode {
            self.note(Sign::RepeatedCode);
        }
    }

    /// Processes the services that the peer reports: name, major and minor version.
    pub fn handle_services<S: AsRef<str>>(
        &mut self,
        services: impl IntoIterator<Item = (S, u8, u8)>,
    ) {
        let (mut core, mut newer) = (0, 0);
        for (urn, major, minor) in services {
            let urn = urn.as_ref();
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

    /// Whether it repeats version octets in the middle of a TCP stream.
    pub(crate) const fn repeats_version(&self) -> bool {
        self.signs.has(Sign::RepeatedVersion)
    }

    /// The current verdict.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let (peer, certainty) = self.best();
        let reasons = self.signs.iter().collect();
        Verdict {
            peer,
            certainty,
            reasons,
        }
    }

    /// The peer recognised with certainty; otherwise [`Implementation::Standard`].
    #[must_use]
    pub const fn certain(&self) -> Implementation {
        self.certain
    }

    /// The peer recognised with certainty; otherwise a presumption, for uses where a wrong guess
    /// does little harm. A peer is presumed to be Junior if that is likely: it begins with number
    /// 1, and then calls an unknown id or sends fragments of Junior's length. A peer of which
    /// nothing else is likely, but that offers services of the interoperability profiles, is
    /// presumed to follow them in all.
    #[must_use]
    pub fn presumed(&self) -> Implementation {
        match self.best() {
            _ if self.certain != Implementation::Standard => self.certain,
            (Implementation::Junior, Certainty::Likely) => Implementation::Junior,
            (_, Certainty::Unknown | Certainty::Guess) if self.signs.has(Sign::IopService) => {
                Implementation::Iop
            }
            _ => Implementation::Standard,
        }
    }

    /// The peer with the most evidence, and its certainty; the first if several are equal.
    fn best(&self) -> (Implementation, Certainty) {
        let weighed = Implementation::ALL.map(|peer| (self.signs.weight(peer), peer));
        let most = weighed.into_iter().rev().max_by_key(|&(weight, _)| weight);
        let (weight, peer) = most.unwrap_or_default();
        let certainty = match weight {
            0 => Certainty::Unknown,
            1 => Certainty::Guess,
            2..=3 => Certainty::Likely,
            _ => Certainty::Certain,
        };
        (peer, certainty)
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
        // A discovery query may well address a single node.
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
        let offers = registration.service_list.iter();
        self.handle_services(offers.map(|it| {
            let urn = it.uri.to_string_lossy();
            (urn, it.major_version_number, it.minor_version_number)
        }));
    }

    /// JAUS++ is recognised by the length of its fragments except the last, and by the code in all
    /// of them. A fragment out of order is not evidence.
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

/// Whether this is Junior's faulty encoding of a message with priority 0: the flags octet, computed
/// as -1, has all bits set. Its broadcast, acknowledgement and fragment fields are lost.
#[must_use]
pub(crate) fn is_priority_fault(frame: &Frame) -> bool {
    frame.version == Version::As5669a && frame.flags == Flags(0xFF) && !frame.payload.is_empty()
}
