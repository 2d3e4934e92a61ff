//! Errors of decoding and encoding messages.
//!
//! An error is created at its cause. The names of the enclosing fields are added as it propagates,
//! so the path costs nothing on success.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// The octets are not a valid message of the expected type.
///
/// Prints as `ReportGlobalPose (4402h): Altitude at octet 12: 4 octets wanted, 2 left`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodeError(Box<Failure<DecodeErrorKind>>);

/// The message cannot be encoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodeError(Box<Failure<EncodeErrorKind>>);

/// Cause of a decoding error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeErrorKind {
    /// The message ends inside a field.
    Short {
        /// Size of the field in octets.
        wanted: u64,
        /// Octets remaining.
        left: usize,
    },
    /// Octets follow the end of the message.
    Trailing {
        /// Number of octets after the end.
        octets: usize,
    },
    /// The message has another code.
    Code {
        /// The code in the octets.
        found: u16,
        /// The code of the expected message.
        expected: u16,
    },
    /// The presence vector sets undefined bits.
    Presence {
        /// The vector.
        found: u64,
        /// Mask of all defined bits.
        defined: u64,
    },
    /// A count of elements or octets is outside its limits.
    Count {
        /// The count.
        found: u64,
        /// The least count that the definition allows.
        min: u64,
        /// The greatest count that the definition allows.
        max: u64,
    },
    /// A variant's tag selects no alternative.
    Tag {
        /// The tag.
        found: u64,
        /// Number of alternatives.
        alternatives: u64,
    },
    /// The index of a `variable_field` selects no type.
    Choice {
        /// The index.
        found: u8,
    },
}

/// Cause of an encoding error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeErrorKind {
    /// The number of elements or octets is outside the limits of the definition.
    Count {
        /// Actual number.
        found: u64,
        /// The least number that the definition allows.
        min: u64,
        /// The greatest number that the definition allows.
        max: u64,
    },
}

/// A cause and its location.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Failure<K> {
    kind: K,
    offset: usize,
    message: Option<(&'static str, u16)>,
    /// Innermost first.
    path: Vec<Step>,
}

/// One step of the path to a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Member(&'static str),
    Element(usize),
}

impl<K> Failure<K> {
    fn new(kind: K, offset: usize) -> Box<Self> {
        Box::new(Self {
            kind,
            offset,
            message: None,
            path: Vec::new(),
        })
    }

    /// The path in JSIDL names, for example `NodeList[2].NodeID`.
    fn path(&self) -> String {
        let mut path = String::new();
        for step in self.path.iter().rev() {
            match step {
                Step::Member(name) if path.is_empty() => path.push_str(name),
                Step::Member(name) => path.extend([".", name]),
                Step::Element(index) => path.push_str(&format!("[{index}]")),
            }
        }
        path
    }

    fn heading(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((name, code)) = self.message {
            write!(f, "{name} ({code:04X}h): ")?;
        }
        if !self.path.is_empty() {
            write!(f, "{} ", self.path())?;
        }
        write!(f, "at octet {}: ", self.offset)
    }
}

macro_rules! failure {
    ($error:ident, $kind:ident) => {
        impl $error {
            #[cold]
            #[inline(never)]
            pub(crate) fn new(kind: $kind, offset: usize) -> Self {
                Self(Failure::new(kind, offset))
            }

            /// Adds the enclosing member to the path.
            #[doc(hidden)]
            #[cold]
            #[inline(never)]
            #[must_use]
            pub fn within(mut self, member: &'static str) -> Self {
                self.0.path.push(Step::Member(member));
                self
            }

            /// Adds the index of the enclosing element to the path.
            #[doc(hidden)]
            #[cold]
            #[inline(never)]
            #[must_use]
            pub fn element(mut self, index: usize) -> Self {
                self.0.path.push(Step::Element(index));
                self
            }

            /// Adds the enclosing message.
            #[cold]
            #[inline(never)]
            #[must_use]
            pub(crate) fn of(mut self, name: &'static str, code: u16) -> Self {
                self.0.message = Some((name, code));
                self
            }

            /// The cause.
            pub fn kind(&self) -> $kind {
                self.0.kind
            }

            /// Offset of the field in octets, counted from 0 at the message code.
            pub fn offset(&self) -> usize {
                self.0.offset
            }

            /// The name of the message in its definition.
            pub fn message(&self) -> Option<&'static str> {
                self.0.message.map(|(name, _)| name)
            }

            /// The path to the field in JSIDL names, such as `NodeList[2].NodeID`. Empty if the
            /// error concerns the message as a whole.
            pub fn path(&self) -> String {
                self.0.path()
            }
        }

        impl core::error::Error for $error {}

        impl fmt::Display for $error {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.heading(f)?;
                self.0.kind.fmt(f)
            }
        }
    };
}

failure!(DecodeError, DecodeErrorKind);
failure!(EncodeError, EncodeErrorKind);

impl fmt::Display for DecodeErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { wanted, left } => write!(f, "{wanted} octets wanted, {left} left"),
            Self::Trailing { octets } => write!(f, "{octets} octets follow the message"),
            Self::Code { found, expected } => {
                write!(f, "message code {found:04X}h, {expected:04X}h expected")
            }
            Self::Presence { found, defined } => {
                let undefined = found & !defined;
                write!(
                    f,
                    "presence vector {found:#x} sets undefined bits {undefined:#x}"
                )
            }
            Self::Count { found, min, max } => write!(f, "count {found} is not in {min} to {max}"),
            Self::Tag {
                found,
                alternatives: 0,
            } => {
                write!(
                    f,
                    "tag {found}, but a variant without alternatives has tag 0"
                )
            }
            Self::Tag {
                found,
                alternatives,
            } => {
                write!(f, "tag {found} chooses none of {alternatives} alternatives")
            }
            Self::Choice { found } => write!(f, "index {found} chooses no type"),
        }
    }
}

impl fmt::Display for EncodeErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { found, min, max } => write!(f, "count {found} is not in {min} to {max}"),
        }
    }
}
