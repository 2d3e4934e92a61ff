//! Resolved model of the language: services and messages after every reference is followed.
//!
//! The model is independent of XML. The reader, the resolver and the checker build these types; the
//! emitters and the dynamic codec only read them. A [`Service`] holds the messages that it declares
//! itself; [`Library`](crate::Library) finds the inherited ones.
//!
//! On the wire a message is `code ++ header ++ body ++ footer`, little-endian, without padding.

use std::fmt;
use std::sync::Arc;

use crate::behaviour::StateMachine;
use crate::permission::Permission;
pub use crate::source::Location;

/// A service's version, `major.minor`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// Incremented for incompatible changes.
    pub major: u8,
    /// Incremented for additions.
    pub minor: u8,
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// Identity of a service, a type set or a constant set: its URN and version.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id {
    /// For example `urn:jaus:jss:core:Discovery`.
    pub urn: Arc<str>,
    /// For example `1.1`.
    pub version: Version,
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.urn, self.version)
    }
}

/// Reference to another service, from the `references` of a service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reference {
    /// The local alias, which qualifies the names of states and actions.
    pub name: String,
    /// The identity of the referenced service.
    pub id: Id,
    /// Position of the reference.
    pub location: Location,
}

/// A `service_def`.
#[derive(Debug, Clone, PartialEq)]
pub struct Service {
    /// For example `Discovery`.
    pub name: String,
    /// URN and version.
    pub id: Id,
    /// The author's text, white space folded.
    pub description: String,
    /// The service that this one extends, if any.
    pub inherits_from: Option<Reference>,
    /// Services whose messages this one uses as a client.
    pub client_of: Vec<Reference>,
    /// Messages that the service receives; inherited ones are not repeated.
    pub inputs: Vec<Arc<Message>>,
    /// Messages that the service sends; inherited ones are not repeated.
    pub outputs: Vec<Arc<Message>>,
    /// State machines that the service declares itself;
    /// [`Library::machines`](crate::Library::machines) merges the inherited ones.
    pub behaviour: Vec<StateMachine>,
    /// Position of the `service_def`.
    pub location: Location,
}

impl Service {
    /// Inputs, then outputs; a message in both sets comes twice.
    pub fn messages(&self) -> impl Iterator<Item = &Arc<Message>> {
        self.inputs.iter().chain(&self.outputs)
    }

    /// Whether it is a service of the core set (AS5710), which components implement themselves.
    pub(crate) fn is_core(&self) -> bool {
        self.id.urn.starts_with("urn:jaus:jss:core:")
    }
}

/// A `message_def`.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// For example `ReportIdentification`.
    pub name: String,
    /// The message code, for example 0x4B00: the first two octets, little-endian.
    pub code: u16,
    /// `is_command`: only the controlling client may send it.
    pub is_command: bool,
    /// `deprecated`: newer services have another message for the purpose.
    pub is_deprecated: bool,
    /// The right that its sender needs: the attributes `permission`, `authority` and `granted` of our own
    /// namespace. `None` if the definition does not state it.
    pub permission: Option<Permission>,
    /// Whether all that it does is to stop or end something: the attribute `stops` of our own namespace.
    pub stops: bool,
    /// The field with the component to which its receiver sends the message behind it, of the messages that
    /// it carries: the attribute `destination` of our own namespace. `None` if the receiver obeys them itself.
    pub destination: Option<String>,
    /// The author's text, white space folded.
    pub description: String,
    /// Fields between the code and the body. `None` for the usual header, whose only field is the
    /// code itself.
    pub header: Option<Item>,
    /// A group, list or variant that is not optional; `None` if the body is empty.
    pub body: Option<Item>,
    /// As [`body`](Self::body); empty in every published definition.
    pub footer: Option<Item>,
    /// Position of the `message_def`.
    pub location: Location,
}

/// A named member of a message: a field or a composite of fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// The JSIDL name, for example `Latitude` or `ComponentList`.
    pub name: String,
    /// Whether a bit of the enclosing group's presence vector controls it.
    pub optional: bool,
    /// The author's `interpretation`, white space folded; empty if there is none.
    pub interpretation: String,
    /// Layout on the wire.
    pub shape: Shape,
    /// Position of the declaration. For a reference, position of the reference.
    pub location: Location,
}

/// The constructs of the language.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// `record` and `sequence`: members one after the other.
    Group(Group),
    /// `list`: a count, then that many elements.
    List(List),
    /// `variant`: a tag, then the selected alternative.
    Variant(Variant),
    /// `fixed_field`.
    Scalar(Scalar),
    /// `bit_field`.
    Bits(BitField),
    /// `fixed_length_string`: exactly this many octets, padded with zeros.
    FixedString {
        /// Octets.
        length: u32,
    },
    /// `variable_length_string`: a count of octets, then the octets.
    VariableString {
        /// The octet count.
        count: Count,
    },
    /// `variable_length_field`: a count of octets, then raw octets.
    Blob {
        /// The octet count.
        count: Count,
        /// The declared format, for example `JAUS MESSAGE`; not on the wire.
        format: String,
    },
    /// `variable_format_field`: a format index (one octet), a count of octets, then raw octets.
    FormattedBlob {
        /// The selectable formats.
        formats: Vec<Format>,
        /// The octet count.
        count: Count,
    },
    /// `variable_field`: an index (one octet) that selects type and units, then the value.
    Measure {
        /// The selectable types and units; `index` is the value on the wire, not the position.
        choices: Vec<Choice>,
    },
    /// `array`: elements back to back without a count; the first dimension varies fastest.
    Array(Array),
}

impl Shape {
    /// The items directly in a composite or an array; none in a field.
    pub(crate) fn items(&self) -> impl Iterator<Item = &Item> {
        let (several, one) = match self {
            Self::Group(group) => (group.members.as_slice(), None),
            Self::Variant(variant) => (variant.alternatives.as_slice(), None),
            Self::List(list) => (&[][..], Some(list.element.as_ref())),
            Self::Array(array) => (&[][..], Some(array.element.as_ref())),
            _ => (&[][..], None),
        };
        several.iter().chain(one)
    }
}

/// `record` (members are fields) or `sequence` (members are composites): one layout.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Spelling used by the definition.
    pub kind: GroupKind,
    /// Present exactly if some member is optional; bit *i* is the *i*-th optional member.
    pub presence: Option<Unsigned>,
    /// In wire order.
    pub members: Vec<Item>,
}

/// The two spellings of [`Group`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupKind {
    /// `record`
    Record,
    /// `sequence`
    Sequence,
}

/// `list`.
#[derive(Debug, Clone, PartialEq)]
pub struct List {
    /// Number of elements.
    pub count: Count,
    /// The one element type; never optional.
    pub element: Box<Item>,
}

/// `variant`.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Type of the tag, which is the zero-based position of the alternative.
    pub tag: Unsigned,
    /// Never optional. May be empty: then the variant is its tag alone, 0.
    pub alternatives: Vec<Item>,
}

/// `fixed_field`, or the value of a `variable_field`.
#[derive(Debug, Clone, PartialEq)]
pub struct Scalar {
    /// Encoding on the wire.
    pub number: Number,
    /// For example `meter` or `one`.
    pub units: String,
    /// Meaning of the number.
    pub meaning: Meaning,
}

/// Interpretation of a number on the wire.
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// Itself.
    Plain,
    /// A real number in a range (`scale_range`); only with integers of at most four octets.
    Scaled(Scale),
    /// One of a set of values (`value_set`). Other values occur and are preserved.
    Values(ValueSet),
}

/// `scale_range`: `value = raw * (upper - lower) / (2^n - 1) + lower`.
///
/// JSIDL has no rule for signed integers; the rule of the Reference Architecture applies: 0 is the
/// centre, `value = raw * (upper - lower) / (2^n - 2) + (upper + lower) / 2`. The least integer is
/// then one step below the lower limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Value of the least raw number; in a signed integer, of the second least.
    pub lower: f64,
    /// Value of the largest raw number; greater than `lower`.
    pub upper: f64,
    /// Conversion of a real number to an integer.
    pub rounding: Rounding,
}

/// `integer_function`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest integer, halves up; published definitions use no other.
    Round,
    /// Down.
    Floor,
    /// Up.
    Ceiling,
}

/// `value_set`: the union of its ranges and its named values.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueSet {
    /// `value_range`s.
    pub ranges: Vec<ValueRange>,
    /// `value_enum`s, in document order.
    pub values: Vec<NamedValue>,
}

/// `value_range`.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueRange {
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
    /// Whether the range excludes `lower`.
    pub lower_exclusive: bool,
    /// Whether the range excludes `upper`.
    pub upper_exclusive: bool,
    /// The author's text.
    pub interpretation: String,
}

/// The limits, such as `above 0 to 1`. A precision limits their decimal places.
impl fmt::Display for ValueRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = |value: f64| match f.precision() {
            Some(places) => shortened(value, places),
            None => value,
        };
        let above = if self.lower_exclusive { "above " } else { "" };
        let below = if self.upper_exclusive { "below " } else { "" };
        let (lower, upper) = (limit(self.lower), limit(self.upper));
        write!(f, "{above}{lower} to {below}{upper}")
    }
}

/// A value with at most so many decimal places, or unchanged if that would change it notably.
pub(crate) fn shortened(value: f64, places: usize) -> f64 {
    let scale = 10_f64.powi(i32::try_from(places).unwrap_or(i32::MAX));
    let shortened = (value * scale).round() / scale;
    let is_close = (shortened - value).abs() < 1.0 / scale;
    if shortened != 0.0 && is_close {
        shortened
    } else {
        value
    }
}

/// `value_enum`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedValue {
    /// Value on the wire: an integer of at most eight octets.
    pub index: i128,
    /// `enum_const`: the author's text, which need not be an identifier.
    pub name: String,
    /// The author's text.
    pub interpretation: String,
}

/// `bit_field`: sub-fields in one unsigned integer, bit 0 the least significant.
#[derive(Debug, Clone, PartialEq)]
pub struct BitField {
    /// The integer on the wire.
    pub base: Unsigned,
    /// In document order; they do not overlap.
    pub fields: Vec<SubField>,
}

/// `sub_field` of a [`BitField`].
#[derive(Debug, Clone, PartialEq)]
pub struct SubField {
    /// The JSIDL name.
    pub name: String,
    /// Lowest bit, from 0.
    pub from: u8,
    /// Highest bit, inclusive.
    pub to: u8,
    /// The values that it may take.
    pub values: ValueSet,
    /// The author's text.
    pub interpretation: String,
}

/// A count that precedes its elements or octets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Count {
    /// Encoding of the count on the wire.
    pub unsigned: Unsigned,
    /// Least count; 0 if not specified.
    pub min: u64,
    /// Greatest count; the type's maximum if not specified.
    pub max: u64,
}

/// `format_enum` of a `variable_format_field`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Format {
    /// Value on the wire.
    pub index: u8,
    /// `field_format`, for example `JPEG`.
    pub name: String,
}

/// `type_and_units_enum` of a `variable_field`.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Value on the wire.
    pub index: u8,
    /// The name; only newer definitions give one.
    pub name: Option<String>,
    /// Type, units and meaning of the value.
    pub scalar: Scalar,
}

/// Whether this format of raw octets holds a message that begins with its code. Definitions differ in
/// the spelling.
pub(crate) const fn is_message_format(format: &str) -> bool {
    format.eq_ignore_ascii_case("JAUS MESSAGE")
}

/// `array`.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Sizes, in document order; the first varies fastest on the wire.
    pub dimensions: Vec<u32>,
    /// The element type: a field, never optional.
    pub element: Box<Item>,
}

/// Number types of `fixed_field`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Number {
    /// An unsigned integer.
    Unsigned(Unsigned),
    /// A two's complement integer.
    Signed(Signed),
    /// `float`: IEEE 754, 4 octets.
    F32,
    /// `long float`: IEEE 754, 8 octets.
    F64,
}

impl Number {
    /// Octets on the wire.
    pub const fn size(self) -> usize {
        match self {
            Self::Unsigned(u) => u.size(),
            Self::Signed(s) => s.size(),
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The least and the greatest integer that fit; `None` for the two floating point types.
    pub const fn integers(self) -> Option<(i128, i128)> {
        match self {
            Self::Unsigned(u) => Some((0, u.max() as i128)),
            Self::Signed(s) => {
                let half = 1_i128 << (s.size() * 8 - 1);
                Some((-half, half - 1))
            }
            Self::F32 | Self::F64 => None,
        }
    }
}

/// Unsigned integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Unsigned {
    /// `unsigned byte`
    U8,
    /// `unsigned short integer`
    U16,
    /// `unsigned integer`
    U32,
    /// `unsigned long integer`
    U64,
}

impl Unsigned {
    /// Octets on the wire.
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 => 4,
            Self::U64 => 8,
        }
    }

    /// The largest number that fits.
    pub const fn max(self) -> u64 {
        match self {
            Self::U8 => u8::MAX as u64,
            Self::U16 => u16::MAX as u64,
            Self::U32 => u32::MAX as u64,
            Self::U64 => u64::MAX,
        }
    }
}

/// Signed integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Signed {
    /// `byte`
    I8,
    /// `short integer`
    I16,
    /// `integer`
    I32,
    /// `long integer`
    I64,
}

impl Signed {
    /// Octets on the wire.
    pub const fn size(self) -> usize {
        match self {
            Self::I8 => 1,
            Self::I16 => 2,
            Self::I32 => 4,
            Self::I64 => 8,
        }
    }
}
