//! Value tree: the content of a message, without names.
//!
//! A [`Value`] mirrors the [`Shape`](crate::model::Shape) of its definition member by member. It
//! keeps the integers of the wire, so that decoding and encoding are exact; their meaning (names,
//! units, scaling) is in the definition.

use crate::model::{Array, Number, Shape, Signed, SubField, Unsigned};

/// The content of a message or a part of it.
///
/// The value of a message is that of its body; an empty body is an empty group. If the definition
/// has fields between the code and the body or after the body, the value is a group of three slots:
/// header, body, footer.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `record` or `sequence`: one slot for every member of the definition, in its order; `None`
    /// for an optional member that is absent.
    Group(Vec<Option<Self>>),
    /// The elements of a `list`.
    List(Vec<Self>),
    /// The selected alternative of a `variant`.
    Variant {
        /// Its zero-based position; 0 in a variant without alternatives.
        tag: u64,
        /// Its value; `None` only in a variant without alternatives.
        value: Option<Box<Self>>,
    },
    /// `fixed_field`. A scaled integer is kept as the integer.
    Number(Raw),
    /// `bit_field`: the whole integer, bits that no sub-field owns included.
    Bits(u64),
    /// `fixed_length_string` (without padding zeros) or `variable_length_string`.
    Text(Vec<u8>),
    /// `variable_length_field`.
    Blob(Vec<u8>),
    /// `variable_format_field`.
    Formatted {
        /// The format's index on the wire; unknown ones are preserved.
        format: u8,
        /// The data.
        octets: Vec<u8>,
    },
    /// `variable_field`.
    Measure {
        /// The index on the wire, which selects type and units.
        index: u8,
        /// The number. A scaled integer is kept as the integer.
        number: Raw,
    },
    /// `array`: all elements in wire order, the first dimension fastest.
    Array(Vec<Self>),
}

impl Value {
    /// The kind of value, in JSIDL terms.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Group(_) => "a record or sequence",
            Self::List(_) => "a list",
            Self::Variant { .. } => "a variant",
            Self::Number(_) => "a number",
            Self::Bits(_) => "a bit field",
            Self::Text(_) => "a string",
            Self::Blob(_) => "a variable length field",
            Self::Formatted { .. } => "a variable format field",
            Self::Measure { .. } => "a variable field",
            Self::Array(_) => "an array",
        }
    }
}

/// A number on the wire.
///
/// Floating point numbers are equal if their octets are: a NaN equals itself.
#[derive(Debug, Clone, Copy)]
pub enum Raw {
    /// An unsigned integer of any size.
    Unsigned(u64),
    /// A signed integer of any size.
    Signed(i64),
    /// `float`
    F32(f32),
    /// `long float`
    F64(f64),
}

impl PartialEq for Raw {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Unsigned(a), Self::Unsigned(b)) => a == b,
            (Self::Signed(a), Self::Signed(b)) => a == b,
            (Self::F32(a), Self::F32(b)) => a.to_bits() == b.to_bits(),
            (Self::F64(a), Self::F64(b)) => a.to_bits() == b.to_bits(),
            _ => false,
        }
    }
}

impl Eq for Raw {}

impl std::fmt::Display for Raw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unsigned(n) => n.fmt(f),
            Self::Signed(n) => n.fmt(f),
            Self::F32(n) => n.fmt(f),
            Self::F64(n) => n.fmt(f),
        }
    }
}

impl Shape {
    /// The kind of value that belongs here, in the same terms as [`Value::kind`].
    pub(crate) const fn kind(&self) -> &'static str {
        match self {
            Self::Group(_) => "a record or sequence",
            Self::List(_) => "a list",
            Self::Variant(_) => "a variant",
            Self::Scalar(_) => "a number",
            Self::Bits(_) => "a bit field",
            Self::FixedString { .. } | Self::VariableString { .. } => "a string",
            Self::Blob { .. } => "a variable length field",
            Self::FormattedBlob { .. } => "a variable format field",
            Self::Measure { .. } => "a variable field",
            Self::Array(_) => "an array",
        }
    }
}

impl Number {
    /// The type in JSIDL spelling.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Unsigned(Unsigned::U8) => "unsigned byte",
            Self::Unsigned(Unsigned::U16) => "unsigned short integer",
            Self::Unsigned(Unsigned::U32) => "unsigned integer",
            Self::Unsigned(Unsigned::U64) => "unsigned long integer",
            Self::Signed(Signed::I8) => "byte",
            Self::Signed(Signed::I16) => "short integer",
            Self::Signed(Signed::I32) => "integer",
            Self::Signed(Signed::I64) => "long integer",
            Self::F32 => "float",
            Self::F64 => "long float",
        }
    }
}

impl Array {
    /// Total number of elements in all dimensions.
    pub(crate) fn elements(&self) -> u64 {
        let sizes = self.dimensions.iter().map(|&size| u64::from(size));
        if sizes.clone().any(|size| size == 0) {
            0
        } else {
            sizes.fold(1, u64::saturating_mul)
        }
    }
}

impl SubField {
    /// The bits of the sub-field; none where the definition exceeds 64.
    pub(crate) const fn mask(&self) -> u64 {
        if self.from > self.to || self.to >= u64::BITS as u8 {
            return 0;
        }
        let width = self.to - self.from + 1;
        (u64::MAX >> (u64::BITS as u8 - width)) << self.from
    }
}
