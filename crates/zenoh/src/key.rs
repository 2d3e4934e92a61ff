//! Key expressions.
//!
//! | key | published by | contents |
//! |---|---|---|
//! | `PREFIX/raw/S/N/C/LABEL/FROM/TO` | the bridge `FROM`, for the bridge `TO` or for `all` | one message of the component S.N.C: a JUDP datagram |
//! | `PREFIX/live/S/N/C/FROM` | the bridge `FROM`, as a liveliness token | the component S.N.C is reachable through it |
//! | `PREFIX/json/S/N/C/CODE` | the bridge of S.N.C | a report of that component as JSON |
//!
//! S, N and C are decimal numbers. `CODE` is a message code: four upper-case hexadecimal digits.
//! `LABEL` is a message code, `ack` for a transport acknowledgement, or `part` for a later fragment
//! of a large message.
//!
//! For each message, zenoh (1.10) compares the key chunk by chunk with all declared keys that have
//! begun alike, one after the other. So messages share their first chunk neither with the tokens nor
//! with the views, of which a fleet has thousands, and the first two digits of `TO` are a chunk of
//! their own: a thousand subscriptions are told apart by a few hundred comparisons.

use std::collections::hash_map::RandomState;
use std::fmt;
use std::hash::{BuildHasher, Hasher};
use std::str::FromStr;

use jaus::address::JausId;
use jaus::wire::{DataControl, Frame};

/// The first chunks of every key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prefix(String);

/// The longest prefix, in octets.
const LONGEST_PREFIX: usize = 128;

impl Default for Prefix {
    fn default() -> Self {
        Self("jaus".to_owned())
    }
}

/// A text that is no prefix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "write letters, digits, `_`, `-` and `.` in parts separated by `/`, such as site/jaus, at most \
     {LONGEST_PREFIX} characters"
)]
pub struct InvalidPrefix;

impl FromStr for Prefix {
    type Err = InvalidPrefix;

    fn from_str(text: &str) -> Result<Self, InvalidPrefix> {
        let is_valid = |it: char| it.is_ascii_alphanumeric() || "_-.".contains(it);
        let is_chunk = |chunk: &str| !chunk.is_empty() && chunk.chars().all(is_valid);
        match text.len() <= LONGEST_PREFIX && text.split('/').all(is_chunk) {
            true => Ok(Self(text.to_owned())),
            false => Err(InvalidPrefix),
        }
    }
}

/// Identifies a running bridge: 16 hexadecimal digits, which are the id of its zenoh session too. A restarted
/// bridge has another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BridgeId(u64);

impl BridgeId {
    /// The bridge with this number.
    #[must_use]
    pub const fn new(number: u64) -> Self {
        Self(number)
    }

    /// A random one. Its first digit is not 0, because ids of zenoh have no leading zeros.
    #[must_use]
    pub fn random() -> Self {
        Self(RandomState::new().build_hasher().finish() | 1 << 63)
    }

    fn parse(text: &str) -> Option<Self> {
        let number = u64::from_str_radix(text, 16).ok().map(Self)?;
        (number.to_string() == text).then_some(number)
    }
}

impl fmt::Display for BridgeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// What a message is, without its contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Label {
    /// A message, or the first fragment of one, by its code.
    Code(u16),
    /// A transport acknowledgement.
    Acknowledgement,
    /// A later fragment of a large message.
    Part,
}

impl Label {
    /// The label of a frame; `None` if it has no message code and is neither of the others.
    #[must_use]
    pub fn of(frame: &Frame) -> Option<Self> {
        if frame.is_acknowledgement() {
            return Some(Self::Acknowledgement);
        }
        match frame.flags.data() {
            DataControl::Middle | DataControl::Last => Some(Self::Part),
            _ => frame.code().map(Self::Code),
        }
    }

    fn parse(text: &str) -> Option<Self> {
        match text {
            "ack" => Some(Self::Acknowledgement),
            "part" => Some(Self::Part),
            _ => code(text).map(Self::Code),
        }
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Code(code) => write!(f, "{code:04X}"),
            Self::Acknowledgement => f.write_str("ack"),
            Self::Part => f.write_str("part"),
        }
    }
}

/// The bridges for which a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Recipient {
    /// All that subscribe to its source.
    All,
    /// One.
    Bridge(BridgeId),
}

impl fmt::Display for Recipient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Bridge(BridgeId(id)) => {
                write!(f, "{:02x}/{:014x}", id >> 56, id & (u64::MAX >> 8))
            }
        }
    }
}

/// A key without its prefix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A message.
    Raw {
        /// The component that sends it.
        source: JausId,
        /// What it is.
        label: Label,
        /// The bridge that publishes it.
        from: BridgeId,
        /// The bridges for which it is.
        to: Recipient,
    },
    /// The presence of a component.
    Live {
        /// The component.
        component: JausId,
        /// The bridge through which it is reachable.
        from: BridgeId,
    },
    /// A view of a report.
    Json {
        /// The component that reports.
        component: JausId,
        /// The message code of the report.
        report: u16,
    },
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Raw {
                source,
                label,
                from,
                to,
            } => write!(f, "raw/{}/{label}/{from}/{to}", chunks(*source)),
            Self::Live { component, from } => write!(f, "live/{}/{from}", chunks(*component)),
            Self::Json { component, report } => {
                write!(f, "json/{}/{report:04X}", chunks(*component))
            }
        }
    }
}

impl Prefix {
    /// The key with this prefix.
    #[must_use]
    pub fn key(&self, key: &Key) -> String {
        format!("{}/{key}", self.0)
    }

    /// Reads a key.
    ///
    /// `None` unless it is exactly what [`key`](Self::key) writes: so no two keys mean the same.
    #[must_use]
    pub fn parse(&self, text: &str) -> Option<Key> {
        let rest = text.strip_prefix(&self.0)?.strip_prefix('/')?;
        let mut parts = rest.split('/');
        let kind = parts.next()?;
        let source = JausId::new(
            number(parts.next()?)?,
            number(parts.next()?)?,
            number(parts.next()?)?,
        );
        let key = match kind {
            "raw" => Key::Raw {
                source,
                label: Label::parse(parts.next()?)?,
                from: BridgeId::parse(parts.next()?)?,
                to: recipient(parts.next()?, parts.next())?,
            },
            "live" => Key::Live {
                component: source,
                from: BridgeId::parse(parts.next()?)?,
            },
            "json" => Key::Json {
                component: source,
                report: code(parts.next()?)?,
            },
            _ => return None,
        };
        (source.is_unicast() && parts.next().is_none()).then_some(key)
    }

    /// The messages of these components, which may have wildcards, for these bridges.
    #[must_use]
    pub fn messages_of(&self, components: JausId, to: Recipient) -> String {
        format!("{}/raw/{}/*/*/{to}", self.0, chunks(components))
    }

    /// The presence of these components, which may have wildcards.
    #[must_use]
    pub fn presence_of(&self, components: JausId) -> String {
        format!("{}/live/{}/*", self.0, chunks(components))
    }

    /// The views of all components of a subsystem.
    #[must_use]
    pub fn views_of(&self, subsystem: u16) -> String {
        format!("{}/json/{subsystem}/*/*/*", self.0)
    }
}

/// An id as three chunks of a key expression, a wildcard as `*`.
fn chunks(id: JausId) -> String {
    let chunk = |number: u16, any: bool| match any {
        true => "*".to_owned(),
        false => number.to_string(),
    };
    let (subsystem, node, component) = (id.subsystem(), id.node(), id.component());
    format!(
        "{}/{}/{}",
        chunk(subsystem, subsystem == JausId::ANY_SUBSYSTEM),
        chunk(node.into(), node == JausId::ANY_NODE),
        chunk(component.into(), component == JausId::ANY_COMPONENT),
    )
}

/// A decimal number as it is written: no sign, no leading zeros.
fn number<N: FromStr + fmt::Display>(text: &str) -> Option<N> {
    let number: N = text.parse().ok()?;
    (number.to_string() == text).then_some(number)
}

fn code(text: &str) -> Option<u16> {
    let code = u16::from_str_radix(text, 16).ok()?;
    (format!("{code:04X}") == text).then_some(code)
}

/// The recipient in one chunk or two. `None` if the second one is missing, or is one too many.
fn recipient(first: &str, second: Option<&str>) -> Option<Recipient> {
    match second {
        None => (first == "all").then_some(Recipient::All),
        Some(second) if first.len() == 2 => {
            BridgeId::parse(&format!("{first}{second}")).map(Recipient::Bridge)
        }
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jaus::wire::{Acknowledgement, Flags};
    use proptest::prelude::*;

    use super::*;

    const SENSOR: JausId = JausId::new(101, 1, 43);
    const BRIDGE: BridgeId = BridgeId::new(0xAB);

    fn keys() -> [(Key, &'static str); 5] {
        let raw = |label, to| Key::Raw {
            source: SENSOR,
            label,
            from: BRIDGE,
            to,
        };
        [
            (
                raw(Label::Code(0x4404), Recipient::All),
                "jaus/raw/101/1/43/4404/00000000000000ab/all",
            ),
            (
                raw(
                    Label::Acknowledgement,
                    Recipient::Bridge(BridgeId::new(u64::MAX)),
                ),
                "jaus/raw/101/1/43/ack/00000000000000ab/ff/ffffffffffffff",
            ),
            (
                raw(Label::Part, Recipient::All),
                "jaus/raw/101/1/43/part/00000000000000ab/all",
            ),
            (
                Key::Live {
                    component: SENSOR,
                    from: BRIDGE,
                },
                "jaus/live/101/1/43/00000000000000ab",
            ),
            (
                Key::Json {
                    component: SENSOR,
                    report: 0x4404,
                },
                "jaus/json/101/1/43/4404",
            ),
        ]
    }

    #[test]
    fn every_key_is_read_as_it_is_written() {
        let prefix = Prefix::default();
        for (key, text) in keys() {
            assert_eq!(prefix.key(&key), text);
            assert_eq!(prefix.parse(text), Some(key));
        }
    }

    #[test]
    fn a_key_in_another_form_is_refused() {
        for text in [
            "",
            "jaus",
            "jaus/",
            "jaus/101/1/43",
            "other/json/101/1/43/4404",
            "jausx/json/101/1/43/4404",
            "jaus/json/0101/1/43/4404",
            "jaus/json/+101/1/43/4404",
            "jaus/json/65535/1/43/4404",
            "jaus/json/101/255/43/4404",
            "jaus/json/101/1/0/4404",
            "jaus/json/101/1/256/4404",
            "jaus/json/101/1/43/404",
            "jaus/json/101/1/43/44O4",
            "jaus/json/101/1/43/aaaa",
            "jaus/json/101/1/43/4404/",
            "jaus/json/101/1/43/4404/x",
            "jaus/live/101/1/43/ab",
            "jaus/live/101/1/43/00000000000000AB",
            "jaus/raw/101/1/43/4404/00000000000000ab",
            "jaus/raw/101/1/43/4404/00000000000000ab/ALL",
            "jaus/json/*/1/43/4404",
        ] {
            assert_eq!(Prefix::default().parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_prefix_has_no_characters_with_a_meaning_in_key_expressions() {
        assert_eq!("site/jaus-1".parse(), Ok(Prefix("site/jaus-1".to_owned())));
        for text in ["", "/", "a//b", "a/", "*", "a/**", "a$*", "a?b", "a#b", "ä"] {
            assert_eq!(text.parse::<Prefix>(), Err(InvalidPrefix), "{text}");
        }
        assert_eq!("a".repeat(129).parse::<Prefix>(), Err(InvalidPrefix));
    }

    #[test]
    fn a_subscription_names_only_what_is_not_a_wildcard() {
        let prefix = Prefix::default();
        let rover = JausId::new(101, 255, 255);
        assert_eq!(
            prefix.messages_of(rover, Recipient::All),
            "jaus/raw/101/*/*/*/*/all"
        );
        assert_eq!(
            prefix.messages_of(JausId::EVERYONE, Recipient::Bridge(BRIDGE)),
            "jaus/raw/*/*/*/*/*/00/000000000000ab"
        );
        assert_eq!(prefix.presence_of(SENSOR), "jaus/live/101/1/43/*");
        assert_eq!(prefix.views_of(101), "jaus/json/101/*/*/*");
    }

    #[test]
    fn a_frame_without_a_code_is_labelled_by_what_it_is() {
        let frame = |flags, payload: &'static [u8]| Frame {
            flags,
            ..Frame::new(SENSOR, JausId::new(60, 1, 1), Bytes::from_static(payload))
        };
        let plain = Flags::default();
        let answer = plain.with_acknowledgement(Acknowledgement::Positive);
        let last = plain.with_data(DataControl::Last);
        assert_eq!(
            Label::of(&frame(plain, b"\x04\x44")),
            Some(Label::Code(0x4404))
        );
        assert_eq!(Label::of(&frame(answer, b"")), Some(Label::Acknowledgement));
        assert_eq!(Label::of(&frame(last, b"\x04\x44")), Some(Label::Part));
        assert_eq!(Label::of(&frame(plain, b"\x04")), None);
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "(jaus/)?[0-9a-z*/]{0,40}") {
            if let Some(key) = Prefix::default().parse(&text) {
                prop_assert_eq!(Prefix::default().key(&key), text);
            }
        }
    }
}
