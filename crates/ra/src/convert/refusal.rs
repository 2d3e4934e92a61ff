//! Reasons why a message was not converted.

use std::fmt;

use jaus::codec::{DecodeError, EncodeError, OutOfRange};

/// A message that has no equivalent on the other side. A message converts completely or is refused;
/// no value is adjusted to fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The other side has no such message.
    #[error("message {0:04X}h has no counterpart on the other side")]
    NoCounterpart(u16),
    /// The payload is too short for a code.
    #[error("the payload has no message code")]
    NoCode,
    /// The octets do not decode as the message of this code.
    #[error(transparent)]
    Malformed(#[from] DecodeError),
    /// A number out of range of the other side's field.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A field that is set but does not exist on the other side, where leaving it out would change
    /// the meaning.
    #[error("{field} cannot be expressed on the other side")]
    Inexpressible {
        /// The field's name in the source definition.
        field: &'static str,
    },
    /// A field that is not set but mandatory on the other side.
    #[error("{field} is missing, but the other side requires it")]
    Missing {
        /// The field's name in the target definition.
        field: &'static str,
    },
    /// An enumerated value unknown on the other side.
    #[error("{field} {value} has no counterpart on the other side")]
    UnknownValue {
        /// The field's name in the source definition.
        field: &'static str,
        /// The value.
        value: u32,
    },
    /// A component id without mapping on the other side.
    #[error("{field} names a component that is unknown on the other side")]
    UnknownId {
        /// The field's name in the source definition.
        field: &'static str,
    },
    /// More elements or octets than the other side's message can hold.
    #[error(transparent)]
    TooLong(#[from] EncodeError),
}

/// The kinds of [`Refusal`], for counting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Reason {
    /// [`Refusal::NoCounterpart`].
    NoCounterpart,
    /// [`Refusal::Malformed`], [`Refusal::NoCode`].
    Malformed,
    /// [`Refusal::OutOfRange`].
    OutOfRange,
    /// [`Refusal::Inexpressible`].
    Inexpressible,
    /// [`Refusal::Missing`].
    Missing,
    /// [`Refusal::UnknownValue`].
    UnknownValue,
    /// [`Refusal::UnknownId`].
    UnknownId,
    /// [`Refusal::TooLong`].
    TooLong,
}

impl Reason {
    /// All reasons, in the order of their discriminants.
    pub const ALL: [Self; 8] = [
        Self::NoCounterpart,
        Self::Malformed,
        Self::OutOfRange,
        Self::Inexpressible,
        Self::Missing,
        Self::UnknownValue,
        Self::UnknownId,
        Self::TooLong,
    ];

    /// Name in counters.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoCounterpart => "no counterpart",
            Self::Malformed => "malformed",
            Self::OutOfRange => "out of range",
            Self::Inexpressible => "inexpressible",
            Self::Missing => "missing field",
            Self::UnknownValue => "unknown value",
            Self::UnknownId => "unknown id",
            Self::TooLong => "too long",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Refusal {
    /// The kind of refusal.
    #[must_use]
    pub const fn reason(&self) -> Reason {
        match self {
            Self::NoCounterpart(_) => Reason::NoCounterpart,
            Self::NoCode | Self::Malformed(_) => Reason::Malformed,
            Self::OutOfRange(_) => Reason::OutOfRange,
            Self::Inexpressible { .. } => Reason::Inexpressible,
            Self::Missing { .. } => Reason::Missing,
            Self::UnknownValue { .. } => Reason::UnknownValue,
            Self::UnknownId { .. } => Reason::UnknownId,
            Self::TooLong(_) => Reason::TooLong,
        }
    }
}
