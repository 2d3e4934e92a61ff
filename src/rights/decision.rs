//! What was decided about a message, for logs and audit logs, and the answer to a refused request.

use std::collections::BTreeSet;
use std::fmt;

use super::carried::{self, Carried};
use super::{Permission, Refusal, Rules, Table, Unaccepted, begins, is_recorded, table};
use crate::address::JausId;
use crate::codec::Message as _;
use crate::messages::core::{ConfirmControl, RequestControl, confirm_control::ResponseCode};
use crate::wire::{Flags, Frame};

/// Names of carried messages that a decision lists. Further ones are counted.
const MOST_NAMES: usize = 4;
/// The requests for control that are answered, with their answers and the response code for insufficient
/// authority: those of Access Control (AS5710A) and of Handoff (RAS-G interoperability profiles), whose
/// set is optional here.
const DENIALS: [(&str, &str, u8); 2] = [
    (
        RequestControl::NAME,
        ConfirmControl::NAME,
        ResponseCode::INSUFFICIENT_AUTHORITY.0,
    ),
    ("RequestHandoff", "ConfirmHandoffRequest", 6),
];

/// What was decided about one message.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Decision {
    /// The messages that matter: `RequestControl`, or, of a message that carries others,
    /// `RequestControl in CreateEvent`.
    pub what: String,
    /// The sender.
    pub source: JausId,
    /// The destination, which may have wildcards.
    pub destination: JausId,
    /// What was decided.
    pub verdict: Verdict,
    /// Whether a message that passed needs no right, such as Release Control; or changes nothing, as
    /// [`InControl`](super::InControl) tells.
    pub is_free: bool,
}

/// How much a decision matters to who looks for what was done, the least first. Where there is no room for
/// all, the more important ones keep theirs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Weight {
    /// Nothing was done.
    Refusal,
    /// Everybody may do it.
    Free,
    /// It needed a right, or a component has decided about control.
    Evidence,
}

/// What was decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Verdict {
    /// No rule forbids it: it was passed on to the component, which decides.
    Passed,
    /// It was refused.
    Refused(Unaccepted),
    /// The source, a component, tells the destination that it has control.
    Granted,
    /// The source, a component, tells the destination that it does not get control now.
    Denied,
    /// The source, a component, tells the destination that it no longer has control.
    Ended,
}

impl Decision {
    /// The decision on a frame, by which an audit log shows what its sender tried: `None` if it passes
    /// and concerns neither control, nor an emergency, nor the configuration of a component.
    #[must_use]
    pub fn of(frame: &Frame, checked: Result<(), Unaccepted>, table: &Table) -> Option<Self> {
        match checked {
            Ok(()) if is_recorded(frame, table) => {
                let matters = |message: &[u8]| table.needs(message).any(Permission::is_recorded);
                let what = what(&frame.payload, table, matters);
                let is_free = needs_nothing(&frame.payload, table);
                let passed = Self::new(frame, what, Verdict::Passed);
                Some(Self { is_free, ..passed })
            }
            Ok(()) => None,
            Err(why) => {
                let matters = |message: &[u8]| !needs_nothing(message, table);
                let what = what(&frame.payload, table, matters);
                Some(Self::new(frame, what, Verdict::Refused(why)))
            }
        }
    }

    pub(super) fn new(frame: &Frame, what: String, verdict: Verdict) -> Self {
        Self {
            what,
            source: frame.source,
            destination: frame.destination,
            verdict,
            is_free: false,
        }
    }

    /// Whether it refuses something, so that nothing was done.
    #[must_use]
    pub const fn is_refusal(&self) -> bool {
        matches!(self.verdict, Verdict::Refused(_))
    }

    /// How much it matters.
    #[must_use]
    pub const fn weight(&self) -> Weight {
        match self.verdict {
            Verdict::Refused(_) | Verdict::Denied => Weight::Refusal,
            Verdict::Passed | Verdict::Granted | Verdict::Ended if self.is_free => Weight::Free,
            _ => Weight::Evidence,
        }
    }
}

/// One line, such as `RequestControl from 60.1.1 to 101.1.1: its sender may not take control`.
impl fmt::Display for Decision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            what,
            source,
            destination,
            verdict,
            ..
        } = self;
        write!(f, "{what} from {source} to {destination}")?;
        match verdict {
            Verdict::Refused(why) => write!(f, ": {why}"),
            _ => Ok(()),
        }
    }
}

/// The names of the messages that matter: those that the message carries, and then its own; or its own
/// alone.
fn what(message: &[u8], table: &Table, matters: impl Fn(&[u8]) -> bool) -> String {
    let own = table.name_of(message);
    let mut inside = Inside::default();
    inside.find(message, (table, carried::DEEPEST), &matters);
    if inside.names.is_empty() && !matters(message) {
        // A rule excludes what everybody may otherwise do: it may be any of them.
        inside.find(message, (table, carried::DEEPEST), &|_| true);
    }
    if inside.names.is_empty() {
        return own;
    }
    let names = inside.names.join(", ");
    match inside.further {
        0 => format!("{names} in {own}"),
        further => format!("{names} and {further} others in {own}"),
    }
}

/// The messages inside a message that matter, each kind once.
#[derive(Default)]
struct Inside {
    names: Vec<String>,
    further: usize,
    /// The code of each, and whether it is for all clients, which its name tells.
    kinds: BTreeSet<(Option<u16>, bool)>,
}

impl Inside {
    fn find(
        &mut self,
        message: &[u8],
        (table, depth): (&Table, usize),
        matters: &impl Fn(&[u8]) -> bool,
    ) {
        let Carried::Messages(carried) = table.carried(message) else {
            return;
        };
        for message in carried.into_iter().filter(|_| depth > 0) {
            let message = message.octets;
            let clears_all = |it| it == Permission::ClearAnyEmergency;
            let kind = (
                table::code_of(message),
                table.needs(message).any(clears_all),
            );
            if matters(message) && self.kinds.insert(kind) {
                if self.names.len() < MOST_NAMES {
                    self.names.push(table.name_of(message));
                } else {
                    self.further += 1;
                }
            }
            self.find(message, (table, depth - 1), matters);
        }
    }
}

/// Whether everybody may send a message: a definition states it, and that it needs no right.
fn needs_nothing(message: &[u8], table: &Table) -> bool {
    let mut needs = table.needs(message).peekable();
    needs.peek().is_some() && needs.all(Permission::needs_no_right)
}

/// Checks a frame while nothing can be recorded: what only queries, ends or stops ([`Table::stops`]), passes.
///
/// # Errors
/// [`Refusal::Unrecorded`].
pub fn check_unrecorded(frame: &Frame, table: &Table) -> Result<(), Refusal> {
    if begins(frame) && table.stops(&frame.payload) {
        return Ok(());
    }
    let checked = Rules::default().check(frame, table);
    checked.map_err(|_| Refusal::Unrecorded)
}

/// The answer to a refused request for control to one component: as from the component, Confirm Control
/// or Confirm Handoff Request with the response code for insufficient authority. `None` if the frame is
/// another message.
#[must_use]
pub fn denial(refused: &Frame) -> Option<Frame> {
    if !refused.destination.is_unicast() || !begins(refused) {
        return None;
    }
    let (table, code) = (Table::default(), refused.code()?);
    let payload = DENIALS.iter().find_map(|(request, answer, decision)| {
        let is_request = table.names(code).iter().any(|it| it == request);
        is_request
            .then(|| table.answer(answer, *decision))
            .flatten()
    })?;
    Some(Frame {
        version: refused.version,
        flags: Flags::new(refused.flags.priority()),
        ..Frame::new(refused.destination, refused.source, payload)
    })
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    const OPERATOR: JausId = JausId::new(60, 1, 1);
    const VEHICLE: JausId = JausId::new(101, 1, 1);

    fn frame(payload: &[u8]) -> Frame {
        Frame::new(OPERATOR, VEHICLE, Bytes::copy_from_slice(payload))
    }

    /// Create Command Event: request 1, 10 s, and this message.
    fn event(message: &[u8]) -> Vec<u8> {
        let length = (message.len() as u32).to_le_bytes();
        [&b"\xF6\x01\x01\x0A\0\0\0"[..], &length, message].concat()
    }

    /// Set Element: request 1, and these messages, each as an element.
    fn list(messages: &[&[u8]]) -> Vec<u8> {
        let mut list = vec![0x1A, 0x04, 1, messages.len() as u8];
        for message in messages {
            list.extend([1, 0, 0, 0, 0, 0, 0]);
            list.extend((message.len() as u16).to_le_bytes());
            list.extend(*message);
        }
        list
    }

    fn decided(rules: &str, payload: &[u8]) -> Option<Decision> {
        let (frame, table) = (frame(payload), Table::default());
        let rules: Rules = rules.parse().unwrap();
        let checked = rules.check(&frame, &table).map_err(Unaccepted::Rule);
        Decision::of(&frame, checked, &table)
    }

    const REQUEST: &[u8] = b"\x0D\x00\x64";
    const SHUTDOWN: &[u8] = b"\x02\x00";
    const WRENCH: &[u8] = b"\x05\x04\x00";

    #[test]
    fn carried_messages_are_recorded_by_their_own_names() {
        for (payload, what) in [
            (REQUEST.to_vec(), "RequestControl"),
            (event(REQUEST), "RequestControl in CreateCommandEvent"),
            (
                list(&[WRENCH, REQUEST, SHUTDOWN, REQUEST]),
                "RequestControl, Shutdown in SetElement",
            ),
            (
                event(&list(&[REQUEST])),
                "RequestControl in CreateCommandEvent",
            ),
        ] {
            let allowed = decided("control=127 configure", &payload).unwrap();
            assert_eq!((&*allowed.what, allowed.verdict), (what, Verdict::Passed));
            assert_eq!((allowed.source, allowed.destination), (OPERATOR, VEHICLE));
        }
        assert_eq!(decided("command", &event(WRENCH)), None);
    }

    #[test]
    fn what_needs_a_right_outweighs_what_everybody_may_and_that_a_refusal() {
        let weight = |rules, payload| decided(rules, payload).unwrap().weight();
        assert_eq!(weight("control=127", REQUEST), Weight::Evidence);
        assert_eq!(weight("", b"\x0E\x00"), Weight::Free, "Release Control");
        assert_eq!(
            weight("", b"\x06\x00\x01\x00"),
            Weight::Free,
            "Set Emergency"
        );
        assert_eq!(weight("", REQUEST), Weight::Refusal);
        assert!(Weight::Refusal < Weight::Free && Weight::Free < Weight::Evidence);
    }

    #[test]
    fn a_refusal_names_what_it_is_about() {
        let control = Verdict::Refused(Unaccepted::Rule(Refusal::Control));
        let excluded = Verdict::Refused(Unaccepted::Rule(Refusal::Excluded));
        for (rules, payload, what, verdict) in [
            ("command", REQUEST.to_vec(), "RequestControl", control),
            (
                "command",
                event(REQUEST),
                "RequestControl in CreateCommandEvent",
                control,
            ),
            (
                "command except=QueryVelocityState",
                b"\xF0\x01\x01\0\0\x01\x04\0\0\0\x04\x24\0\0".to_vec(),
                "QueryVelocityState in CreateEvent",
                excluded,
            ),
        ] {
            let refused = decided(rules, &payload).unwrap();
            assert_eq!((&*refused.what, refused.verdict), (what, verdict));
            assert!(refused.is_refusal());
        }
        let line = decided("", REQUEST).unwrap().to_string();
        let expected = "RequestControl from 60.1.1 to 101.1.1: its sender may not take control";
        assert!(line.starts_with(expected), "{line}");
    }

    #[test]
    fn of_many_kinds_the_first_are_listed_and_the_others_counted() {
        let unknown: Vec<_> = (0..9u8).map(|it| [it, 0xDA]).collect();
        let messages: Vec<_> = unknown.iter().map(|it| &it[..]).collect();
        let refused = decided("command", &list(&messages)).unwrap();
        let expected = "DA00h, DA01h, DA02h, DA03h and 5 others in SetElement";
        assert_eq!(refused.what, expected);
    }

    #[test]
    fn a_decision_of_the_client_in_control_about_others_is_no_release() {
        // It needs a right.
        let decides = decided("control=1", b"\x39\xFF\x01\x01\x00").unwrap();
        assert_eq!(decides.what, "ConfirmReleaseControl");
        assert!(decided("", b"\x39\xFF\x01\x01\x00").unwrap().is_refusal());
        assert_eq!(decided("", b"\x0E\x00").unwrap().what, "ReleaseControl");
    }

    #[test]
    fn a_refused_request_is_answered_in_its_own_words() {
        let answer = |payload: &[u8]| {
            let frame = denial(&frame(payload))?;
            assert_eq!((frame.source, frame.destination), (VEHICLE, OPERATOR));
            Some(frame.payload)
        };
        assert_eq!(answer(REQUEST).as_deref(), Some(&b"\x0F\x00\x02"[..]));
        let handoff = answer(b"\x31\xFF\x64\x00");
        assert_eq!(handoff.as_deref(), Some(&b"\x35\xFF\x00\x06"[..]));
        assert_eq!(answer(SHUTDOWN), None);
        let to_all = Frame {
            destination: JausId::EVERYONE,
            ..frame(REQUEST)
        };
        assert_eq!(denial(&to_all), None);
    }
}
