//! Finds the messages inside a message: the query in a request for an event, the elements of a list,
//! the messages of a mission. `jsidl::permission` describes the notation of layouts.

use crate::address::JausId;

/// How deep messages may be inside each other.
pub(super) const DEEPEST: usize = 8;

/// What a message carries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Carried<'m> {
    /// These messages; none if it is no message that carries others.
    Messages(Vec<Inner<'m>>),
    /// It cannot be told: it is malformed, or a fragment, or of a kind that cannot be read.
    Unclear,
}

/// A message inside another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Inner<'m> {
    pub(super) octets: &'m [u8],
    /// The component to which the receiver sends it; `None` if the receiver itself obeys it.
    pub(super) to: Option<JausId>,
}

/// The messages inside a message. If several layouts fit, those of all of them.
pub(super) fn find<'m>(layouts: &[Layout], message: &'m [u8]) -> Carried<'m> {
    let body = message.get(size_of::<u16>()..).unwrap_or_default();
    let mut found = Vec::new();
    let mut fits = layouts.is_empty();
    for layout in layouts {
        let mut reader = Reader {
            rest: body,
            to: None,
            found: Vec::new(),
        };
        if reader.steps(&layout.0).is_some() {
            fits = true;
            found.append(&mut reader.found);
        }
    }
    if fits {
        Carried::Messages(found)
    } else {
        Carried::Unclear
    }
}

/// Where in a message others are, after its code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout(Vec<Step>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Step {
    /// So many octets.
    Fixed(usize),
    /// A count of this size, and so many octets.
    Octets(usize),
    /// A count of this size, and a message of that length.
    Message(usize),
    /// The component to which the messages behind it are sent.
    Destination,
    /// A format, a count of this size, and a message in one of these formats.
    Formatted(usize, Vec<u8>),
    /// A count of this size, and so many elements.
    List(usize, Vec<Self>),
    /// A presence vector of this size, and members, some of which are optional.
    Group(usize, Vec<(bool, Vec<Self>)>),
    /// A tag of this size, and the alternative with that number.
    Variant(usize, Vec<Vec<Self>>),
    /// What the notation does not express.
    Unknown,
}

impl Layout {
    /// Reads the notation, in brackets; `None` if it is malformed.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let inner = text.strip_prefix('[')?.strip_suffix(']')?;
        let mut notation = Notation(inner);
        let steps = notation.steps()?;
        notation.0.is_empty().then_some(Self(steps))
    }
}

struct Notation<'t>(&'t str);

impl Notation<'_> {
    fn steps(&mut self) -> Option<Vec<Step>> {
        let mut steps = Vec::new();
        while let Some(first) = self.0.chars().next() {
            if matches!(first, ')' | ';') {
                break;
            }
            if first.is_ascii_digit() {
                steps.push(Step::Fixed(self.number()?));
                continue;
            }
            self.0 = &self.0[first.len_utf8()..];
            steps.push(match first {
                // It separates a size from the number of octets after it.
                '.' => continue,
                'b' => Step::Octets(self.number()?),
                'm' => Step::Message(self.number()?),
                'd' => Step::Destination,
                'f' => Step::Formatted(self.number()?, self.formats()?),
                '*' => Step::List(self.number()?, self.enclosed()?.pop()?.1),
                '?' => Step::Group(self.number()?, self.enclosed()?),
                'v' => {
                    let size = self.number()?;
                    let alternatives = self.enclosed()?.into_iter();
                    Step::Variant(size, alternatives.map(|(_, steps)| steps).collect())
                }
                'x' => Step::Unknown,
                _ => return None,
            });
        }
        Some(steps)
    }

    fn number(&mut self) -> Option<usize> {
        let end = self.0.find(|it: char| !it.is_ascii_digit());
        let (digits, rest) = self.0.split_at(end.unwrap_or(self.0.len()));
        self.0 = rest;
        digits.parse().ok()
    }

    fn formats(&mut self) -> Option<Vec<u8>> {
        self.skip(':')?;
        let mut formats = Vec::new();
        loop {
            formats.push(u8::try_from(self.number()?).ok()?);
            if self.skip(',').is_none() {
                return Some(formats);
            }
        }
    }

    /// Members in parentheses, each with whether it is optional.
    fn enclosed(&mut self) -> Option<Vec<(bool, Vec<Step>)>> {
        self.skip('(')?;
        let mut members = Vec::new();
        loop {
            let is_optional = self.skip('~').is_some();
            members.push((is_optional, self.steps()?));
            if self.skip(';').is_none() {
                self.skip(')')?;
                return Some(members);
            }
        }
    }

    fn skip(&mut self, mark: char) -> Option<()> {
        self.0 = self.0.strip_prefix(mark)?;
        Some(())
    }
}

/// Reads a message by its layout.
struct Reader<'m> {
    rest: &'m [u8],
    /// The destination that was read last, in what encloses this place.
    to: Option<JausId>,
    found: Vec<Inner<'m>>,
}

impl<'m> Reader<'m> {
    /// `None` if the message ends too early, or has what is unknown.
    fn steps(&mut self, steps: &[Step]) -> Option<()> {
        // A destination holds in its element of a list, and not for the next one.
        let outer = self.to;
        steps.iter().try_for_each(|step| self.step(step))?;
        self.to = outer;
        Some(())
    }

    fn step(&mut self, step: &Step) -> Option<()> {
        match step {
            Step::Fixed(octets) => _ = self.take(*octets)?,
            Step::Octets(size) => _ = self.counted(*size)?,
            Step::Destination => {
                let octets = self.take(size_of::<u32>())?;
                self.to = Some(JausId::from_wire(*octets.first_chunk()?));
            }
            Step::Message(size) => {
                let message = self.counted(*size)?;
                self.find(message);
            }
            Step::Formatted(size, messages) => {
                let format = self.take(1)?[0];
                let octets = self.counted(*size)?;
                if !messages.contains(&format) {
                    return None;
                }
                self.find(octets);
            }
            Step::List(size, element) => {
                for _ in 0..self.unsigned(*size)? {
                    let before = self.rest.len();
                    self.steps(element)?;
                    if self.rest.len() == before {
                        break;
                    }
                }
            }
            Step::Group(size, members) => {
                let presence = self.unsigned(*size)?;
                let mut bit = 0;
                for (is_optional, steps) in members {
                    let is_there = !is_optional || presence.checked_shr(bit)? & 1 == 1;
                    bit += u32::from(*is_optional);
                    if is_there {
                        self.steps(steps)?;
                    }
                }
            }
            Step::Variant(size, alternatives) => {
                let tag = usize::try_from(self.unsigned(*size)?).ok()?;
                self.steps(alternatives.get(tag)?)?;
            }
            Step::Unknown => return None,
        }
        Some(())
    }

    /// Notes a message, unless there is none.
    fn find(&mut self, octets: &'m [u8]) {
        if !octets.is_empty() {
            self.found.push(Inner {
                octets,
                to: self.to,
            });
        }
    }

    fn take(&mut self, octets: usize) -> Option<&'m [u8]> {
        let (taken, rest) = self.rest.split_at_checked(octets)?;
        self.rest = rest;
        Some(taken)
    }

    fn counted(&mut self, size: usize) -> Option<&'m [u8]> {
        let count = usize::try_from(self.unsigned(size)?).ok()?;
        self.take(count)
    }

    /// An unsigned integer of so many octets.
    fn unsigned(&mut self, size: usize) -> Option<u64> {
        let octets = self.take(size)?;
        let mut wide = [0; 8];
        wide.get_mut(..size)?.copy_from_slice(octets);
        Some(u64::from_le_bytes(wide))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn carried<'m>(layouts: &[&str], message: &'m [u8]) -> Carried<'m> {
        let layouts: Vec<_> = layouts
            .iter()
            .map(|it| Layout::parse(it).unwrap())
            .collect();
        find(&layouts, message)
    }

    fn some<'m>(messages: &[&'m [u8]]) -> Carried<'m> {
        let inner = |&octets| Inner { octets, to: None };
        Carried::Messages(messages.iter().map(inner).collect())
    }

    #[test]
    fn a_destination_is_that_of_the_messages_behind_it_in_its_element() {
        let message = b"\0\0\x02\x21\x01\x65\0\x01A\xFF\xFF\x66\0\x01B\x01C";
        let inner = |octets, to| Inner { octets, to };
        let found = carried(&["[*1(dm1)m1]"], message);
        let expected = [
            inner(b"A", Some(JausId::new(101, 1, 33))),
            inner(b"B", Some(JausId::new(102, 255, 255))),
            inner(b"C", None),
        ];
        assert_eq!(found, Carried::Messages(expected.to_vec()));
        // An id that is cut off is none.
        assert_eq!(carried(&["[*1(dm1)m1]"], &message[..6]), Carried::Unclear);
    }

    #[test]
    fn each_part_of_the_notation_finds_the_message_behind_it() {
        let message = |body: &[u8]| [b"\x00\x00", body].concat();
        for (layout, body) in [
            ("[3m1]", &b"...\x02AB"[..]),
            ("[m2]", b"\x02\0AB"),
            ("[m4]", b"\x02\0\0\0AB"),
            ("[b1m1]", b"\x03...\x02AB"),
            ("[b1.2m1]", b"\x01...\x02AB"),
            ("[f1:0,3]", b"\x03\x02AB"),
            ("[*1(1m1)]", b"\x01.\x02AB"),
            ("[?1(~2;~m1;1)]", b"\x02\x02AB."),
            ("[?1(~2;m1;~1)]", b"\x01..\x02AB"),
            ("[v1(;1m1)]", b"\x01.\x02AB"),
        ] {
            let message = message(body);
            assert_eq!(carried(&[layout], &message), some(&[b"AB"]), "{layout}");
            // What is cut off, wherever, is not clear.
            for end in 2..message.len() {
                let whole = carried(&[layout], &message[..end]);
                let is_cut_behind = whole == some(&[b"AB"]) && layout.ends_with("1)]");
                assert!(whole == Carried::Unclear || is_cut_behind, "{layout} {end}");
            }
        }
    }

    #[test]
    fn a_list_has_all_of_its_messages_and_an_empty_one_none() {
        let list = b"\0\0\x02\x02AB\x02CD";
        assert_eq!(carried(&["[*1(m1)]"], list), some(&[b"AB", b"CD"]));
        assert_eq!(carried(&["[*1(m1)]"], b"\0\0\0"), some(&[]));
        assert_eq!(carried(&["[m1]"], b"\0\0\0"), some(&[]));
        assert_eq!(carried(&["[*4()]"], b"\0\0\xFF\xFF\xFF\xFF"), some(&[]));
    }

    #[test]
    fn what_may_be_read_in_two_ways_has_the_messages_of_both() {
        let message = b"\0\0\x02AB\x01C";
        assert_eq!(carried(&["[m1]", "[3m1]"], message), some(&[b"AB", b"C"]));
        assert_eq!(carried(&["[m4]", "[3m1]"], message), some(&[b"C"]));
        assert_eq!(carried(&["[m4]", "[x]"], message), Carried::Unclear);
        assert_eq!(carried(&[], message), some(&[]));
        assert_eq!(carried(&["[f1:0]"], b"\0\0\x01\x01C"), Carried::Unclear);
    }

    #[test]
    fn what_is_no_notation_is_refused() {
        for text in [
            "",
            "m4",
            "[m]",
            "[y4]",
            "[*1]",
            "[*1(m4]",
            "[m4)]",
            "[f1]",
            "[99999999999999999999]",
        ] {
            assert_eq!(Layout::parse(text), None, "{text}");
        }
    }
}
