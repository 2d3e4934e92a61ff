//! The address of a JAUS component: [`JausId`], the 32-bit id that every JAUS message carries
//! twice, as source and as destination.
//!
//! An id consists of subsystem (a vehicle, an operator station), node (a computer) and component (a
//! program), and is written `101.1.33`. A destination may hold wildcards: subsystem 65535, node 255
//! and component 255 each mean "all of them" in their own field. Zero is not a valid number.

use std::fmt;
use std::str::FromStr;

use deku::ctx::Endian;
use deku::no_std_io::{Read, Seek, Write};
use deku::prelude::*;

/// The id of a component, such as `101.1.33`, or, as a destination, a pattern of ids, such as
/// `101.255.255` for all components of subsystem 101.
///
/// Any 32 bits make a `JausId`, because any 32 bits can arrive; [`is_unicast`](Self::is_unicast)
/// checks that it names one component. Ordering is by subsystem, then node, then component.
///
/// ```
/// use jaus::address::JausId;
///
/// let driver: JausId = "101.1.33".parse()?;
/// assert_eq!(driver, JausId::new(101, 1, 33));
/// assert!("101.1.255".parse::<JausId>()?.matches(driver));
/// assert_eq!(driver.to_wire(), [33, 1, 101, 0]);
/// # Ok::<(), jaus::address::ParseIdError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JausId {
    subsystem: u16,
    node: u8,
    component: u8,
}

/// As in every message header: one number.
impl DekuReader<'_, Endian> for JausId {
    fn from_reader_with_ctx<R: Read + Seek>(
        reader: &mut Reader<R>,
        endian: Endian,
    ) -> Result<Self, DekuError> {
        u32::from_reader_with_ctx(reader, endian).map(Self::from_u32)
    }
}

impl DekuWriter<Endian> for JausId {
    fn to_writer<W: Write + Seek>(
        &self,
        writer: &mut Writer<W>,
        endian: Endian,
    ) -> Result<(), DekuError> {
        self.to_u32().to_writer(writer, endian)
    }
}

impl JausId {
    /// The subsystem number that means every subsystem (AS5669A).
    pub const ANY_SUBSYSTEM: u16 = 0xFFFF;
    /// The node number that means every node (AS5669A).
    pub const ANY_NODE: u8 = 0xFF;
    /// The component number that means every component (AS5669A).
    pub const ANY_COMPONENT: u8 = 0xFF;
    /// Every component of every subsystem: `65535.255.255`.
    pub const EVERYONE: Self = Self::new(Self::ANY_SUBSYSTEM, Self::ANY_NODE, Self::ANY_COMPONENT);

    /// Creates an id from its three numbers.
    #[must_use]
    pub const fn new(subsystem: u16, node: u8, component: u8) -> Self {
        Self {
            subsystem,
            node,
            component,
        }
    }

    /// The subsystem number.
    #[must_use]
    pub const fn subsystem(self) -> u16 {
        self.subsystem
    }

    /// The node number within the subsystem.
    #[must_use]
    pub const fn node(self) -> u8 {
        self.node
    }

    /// The component number within the node.
    #[must_use]
    pub const fn component(self) -> u8 {
        self.component
    }

    /// The id as one number, `subsystem << 16 | node << 8 | component`.
    #[must_use]
    pub const fn to_u32(self) -> u32 {
        (self.subsystem as u32) << 16 | (self.node as u32) << 8 | self.component as u32
    }

    /// The inverse of [`to_u32`](Self::to_u32).
    #[must_use]
    pub const fn from_u32(id: u32) -> Self {
        Self::new((id >> 16) as u16, (id >> 8) as u8, id as u8)
    }

    /// The four octets of a message header: component, node, subsystem low, subsystem high.
    #[must_use]
    pub const fn to_wire(self) -> [u8; 4] {
        self.to_u32().to_le_bytes()
    }

    /// Reads an id from four octets of a message header.
    #[must_use]
    pub const fn from_wire(octets: [u8; 4]) -> Self {
        Self::from_u32(u32::from_le_bytes(octets))
    }

    /// Whether a field is a wildcard: subsystem 65535, node 255 or component 255.
    ///
    /// A single octet FFh within a subsystem number, as in 511, is not a wildcard.
    #[must_use]
    pub const fn has_wildcard(self) -> bool {
        self.subsystem == Self::ANY_SUBSYSTEM
            || self.node == Self::ANY_NODE
            || self.component == Self::ANY_COMPONENT
    }

    /// Whether a field is zero, so that the id names no component.
    #[must_use]
    pub const fn has_zero(self) -> bool {
        self.subsystem == 0 || self.node == 0 || self.component == 0
    }

    /// Whether the id names exactly one component: no wildcard, no zero.
    #[must_use]
    pub const fn is_unicast(self) -> bool {
        !self.has_wildcard() && !self.has_zero()
    }

    /// Whether this destination reaches `component`: each field is equal or a wildcard.
    ///
    /// A zero matches nothing on either side. (One peer family reads zero as a wildcard; adopting
    /// that would make ids with a zero octet reach unrelated components.)
    ///
    /// ```
    /// use jaus::address::JausId;
    ///
    /// let component = JausId::new(101, 1, 33);
    /// assert!(JausId::EVERYONE.matches(component));
    /// assert!(JausId::new(101, 255, 33).matches(component));
    /// assert!(!JausId::new(102, 255, 255).matches(component));
    /// assert!(!JausId::new(101, 1, 0).matches(component));
    /// ```
    #[must_use]
    pub const fn matches(self, component: Self) -> bool {
        !self.has_zero()
            && !component.has_zero()
            && (self.subsystem == component.subsystem || self.subsystem == Self::ANY_SUBSYSTEM)
            && (self.node == component.node || self.node == Self::ANY_NODE)
            && (self.component == component.component || self.component == Self::ANY_COMPONENT)
    }

    /// The components that both destinations reach, each possibly with wildcards; `None` if there are
    /// none.
    ///
    /// ```
    /// use jaus::address::JausId;
    ///
    /// let (all_of_101, first_nodes) = (JausId::new(101, 255, 33), JausId::new(65535, 1, 255));
    /// assert_eq!(all_of_101.intersection(first_nodes), Some(JausId::new(101, 1, 33)));
    /// assert_eq!(all_of_101.intersection(JausId::new(102, 255, 255)), None);
    /// ```
    #[must_use]
    pub fn intersection(self, other: Self) -> Option<Self> {
        fn field<T: PartialEq>(one: T, other: T, any: &T) -> Option<T> {
            match (one == *any, other == *any) {
                (true, _) => Some(other),
                (_, true) => Some(one),
                _ => (one == other).then_some(one),
            }
        }
        Some(Self::new(
            field(self.subsystem, other.subsystem, &Self::ANY_SUBSYSTEM)?,
            field(self.node, other.node, &Self::ANY_NODE)?,
            field(self.component, other.component, &Self::ANY_COMPONENT)?,
        ))
    }

    /// Whether some component is reached by both destinations.
    #[must_use]
    pub fn overlaps(self, other: Self) -> bool {
        self.intersection(other).is_some()
    }

    /// The id with each 0 replaced by the wildcard of its field, which is what some peers mean.
    ///
    /// ```
    /// use jaus::address::JausId;
    ///
    /// assert_eq!(JausId::new(101, 0, 0).with_zeros_for_all(), JausId::new(101, 255, 255));
    /// ```
    #[must_use]
    pub const fn with_zeros_for_all(self) -> Self {
        const fn any_for_zero(octet: u8) -> u8 {
            if octet == 0 { 0xFF } else { octet }
        }
        let subsystem = match self.subsystem {
            0 => Self::ANY_SUBSYSTEM,
            subsystem => subsystem,
        };
        Self::new(
            subsystem,
            any_for_zero(self.node),
            any_for_zero(self.component),
        )
    }

    /// Every component of this id's node: `subsystem.node.255`.
    #[must_use]
    pub const fn whole_node(self) -> Self {
        Self::new(self.subsystem, self.node, Self::ANY_COMPONENT)
    }

    /// Every component of this id's subsystem: `subsystem.255.255`.
    #[must_use]
    pub const fn whole_subsystem(self) -> Self {
        Self::new(self.subsystem, Self::ANY_NODE, Self::ANY_COMPONENT)
    }
}

impl fmt::Display for JausId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (subsystem, node, component) = (self.subsystem, self.node, self.component);
        match f.width() {
            Some(_) => f.pad(&format!("{subsystem}.{node}.{component}")),
            None => write!(f, "{subsystem}.{node}.{component}"),
        }
    }
}

impl fmt::Debug for JausId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Why a text is not a JAUS id.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseIdError {
    /// Not three parts with dots between them.
    #[error("\"{text}\" is not a JAUS id: write subsystem.node.component, such as 101.1.33")]
    Shape {
        /// The text, truncated.
        text: String,
    },
    /// A part is not a decimal number.
    #[error(
        "the {field} of \"{text}\" is not a number: write subsystem.node.component, such as 101.1.33"
    )]
    NotANumber {
        /// The text, truncated.
        text: String,
        /// `subsystem`, `node` or `component`.
        field: &'static str,
    },
    /// A part exceeds the largest number of its field.
    #[error("the {field} of \"{text}\" is above {limit} (the wildcard)")]
    TooLarge {
        /// The text, truncated.
        text: String,
        /// `subsystem`, `node` or `component`.
        field: &'static str,
        /// The largest number of that field.
        limit: u16,
    },
}

impl FromStr for JausId {
    type Err = ParseIdError;

    fn from_str(text: &str) -> Result<Self, ParseIdError> {
        let mut parts = text.split('.');
        let (Some(subsystem), Some(node), Some(component), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(ParseIdError::Shape {
                text: excerpt(text),
            });
        };
        Ok(Self::new(
            parse_field(text, "subsystem", subsystem, Self::ANY_SUBSYSTEM)?,
            parse_field(text, "node", node, Self::ANY_NODE.into())? as u8,
            parse_field(text, "component", component, Self::ANY_COMPONENT.into())? as u8,
        ))
    }
}

/// Parses one number of an id, at most `limit`.
fn parse_field(
    text: &str,
    field: &'static str,
    part: &str,
    limit: u16,
) -> Result<u16, ParseIdError> {
    if part.is_empty() || !part.bytes().all(|octet| octet.is_ascii_digit()) {
        return Err(ParseIdError::NotANumber {
            text: excerpt(text),
            field,
        });
    }
    match part.parse() {
        Ok(number) if number <= limit => Ok(number),
        _ => Err(ParseIdError::TooLarge {
            text: excerpt(text),
            field,
            limit,
        }),
    }
}

/// The beginning of a text, long enough to recognise it in an error.
fn excerpt(text: &str) -> String {
    const LONGEST: usize = 32;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// Serializes as text, `"101.1.33"`.
#[cfg(feature = "serde")]
impl serde::Serialize for JausId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Deserializes from text, `"101.1.33"`.
#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for JausId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl serde::de::Visitor<'_> for Text {
            type Value = JausId;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a JAUS id such as \"101.1.33\"")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<JausId, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_str(Text)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn error(text: &str) -> String {
        text.parse::<JausId>()
            .expect_err("must not parse")
            .to_string()
    }

    #[test]
    fn an_id_is_written_with_dots_and_read_back() {
        let id: JausId = "1000.1.7".parse().unwrap();
        assert_eq!((id.subsystem(), id.node(), id.component()), (1000, 1, 7));
        assert_eq!(id.to_string(), "1000.1.7");
        assert_eq!(format!("{id:>10}|{id:<10}|"), "  1000.1.7|1000.1.7  |");
        assert_eq!("65535.255.255".parse(), Ok(JausId::EVERYONE));
    }

    #[test]
    fn a_wrong_text_is_told_what_is_wrong_with_it() {
        assert_eq!(
            error("101.1"),
            "\"101.1\" is not a JAUS id: write subsystem.node.component, such as 101.1.33"
        );
        assert!(error("1.2.3.4").contains("is not a JAUS id"));
        assert!(error("").contains("is not a JAUS id"));
        assert!(error("1.x.3").starts_with("the node of \"1.x.3\" is not a number"));
        assert!(error("1.2.").starts_with("the component of"));
        assert!(error("+1.2.3").starts_with("the subsystem of"));
        assert_eq!(
            error("65536.1.1"),
            "the subsystem of \"65536.1.1\" is above 65535 (the wildcard)"
        );
        assert_eq!(
            error("1.1.256"),
            "the component of \"1.1.256\" is above 255 (the wildcard)"
        );
        assert!(error("99999999999999999999999999.1.1").contains("is above 65535"));
        assert!(error(&"9".repeat(100_000)).len() < 200);
    }

    #[test]
    fn the_wire_order_is_component_node_subsystem() {
        // From a recorded JAUS++ discovery: source 1000.1.7.
        assert_eq!(
            JausId::from_wire([0x07, 0x01, 0xE8, 0x03]),
            JausId::new(1000, 1, 7)
        );
        assert_eq!(JausId::new(1000, 1, 7).to_wire(), [0x07, 0x01, 0xE8, 0x03]);
    }

    #[test]
    fn wildcards_stand_for_all_only_in_their_own_field() {
        let component = JausId::new(101, 2, 3);
        for pattern in [
            "101.2.3",
            "101.2.255",
            "101.255.3",
            "65535.2.3",
            "101.255.255",
            "65535.255.255",
        ] {
            assert!(
                pattern.parse::<JausId>().unwrap().matches(component),
                "{pattern}"
            );
        }
        for pattern in [
            "101.2.4",
            "101.3.255",
            "102.255.255",
            "255.255.255",
            "511.2.3",
        ] {
            assert!(
                !pattern.parse::<JausId>().unwrap().matches(component),
                "{pattern}"
            );
        }
        assert!(
            JausId::new(0x01FF, 1, 1).is_unicast(),
            "a lone FFh in a subsystem number is no wildcard"
        );
    }

    #[test]
    fn zero_is_nobody() {
        let component = JausId::new(257, 1, 1);
        for pattern in ["0.1.1", "257.0.1", "257.1.0", "0.0.0", "0.255.255"] {
            let pattern: JausId = pattern.parse().unwrap();
            assert!(
                !pattern.matches(component) && !pattern.is_unicast(),
                "{pattern}"
            );
            assert!(!JausId::EVERYONE.matches(pattern), "{pattern}");
        }
    }

    #[test]
    fn order_is_by_subsystem_then_node_then_component() {
        let mut ids =
            ["2.1.1", "1.2.1", "1.1.2", "256.1.1", "1.1.1"].map(|id| id.parse::<JausId>().unwrap());
        ids.sort();
        assert_eq!(
            ids.map(|id| id.to_string()),
            ["1.1.1", "1.1.2", "1.2.1", "2.1.1", "256.1.1"]
        );
    }

    #[cfg(feature = "serde")]
    #[test]
    fn json_shows_an_id_as_text() {
        let id = JausId::new(101, 1, 33);
        assert_eq!(serde_json::to_string(&id).unwrap(), "\"101.1.33\"");
        assert_eq!(serde_json::from_str::<JausId>("\"101.1.33\"").unwrap(), id);
        let wrong = serde_json::from_str::<JausId>("\"101.1.333\"")
            .unwrap_err()
            .to_string();
        assert!(wrong.contains("is above 255"), "{wrong}");
    }

    proptest! {
        #[test]
        fn every_id_survives_text_number_and_wire(number: u32) {
            let id = JausId::from_u32(number);
            prop_assert_eq!(id.to_string().parse(), Ok(id));
            prop_assert_eq!(JausId::from_wire(id.to_wire()), id);
            prop_assert_eq!(id.to_u32(), number);
        }
    }

    #[test]
    fn ids_overlap_where_each_field_is_the_same_or_stands_for_all() {
        let any = u8::MAX;
        let subsystem = JausId::ANY_SUBSYSTEM;
        for (one, other, expected) in [
            (JausId::new(1, 2, 3), JausId::new(1, 2, 3), true),
            (JausId::new(1, 2, 3), JausId::new(9, 2, 3), false),
            (JausId::new(1, 2, 3), JausId::new(1, 9, 3), false),
            (JausId::new(1, 2, 3), JausId::new(1, 2, 9), false),
            (JausId::new(1, any, any), JausId::new(1, 2, 3), true),
            (JausId::new(1, 2, 3), JausId::new(subsystem, 2, any), true),
            (JausId::new(1, any, 3), JausId::new(1, 2, any), true),
            (JausId::new(1, any, 3), JausId::new(1, any, 4), false),
        ] {
            assert_eq!(one.overlaps(other), expected, "{one} and {other}");
            assert_eq!(other.overlaps(one), expected, "{other} and {one}");
        }
    }
}
