//! Why octets are not a message, or a message cannot become octets.
//!
//! The cause is made where it is found; the names of the fields around it are added on the way
//! out, so that the path costs nothing while all is well.

use std::fmt;

/// Octets that are not the message they were taken for.
///
/// Prints as `ReportGlobalPose (4402h): Altitude at octet 12: 4 octets wanted, 2 left`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodeError(Box<Failure<DecodeErrorKind>>);

/// A message that the wire cannot carry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodeError(Box<Failure<EncodeErrorKind>>);

/// What is wrong with the octets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeErrorKind {
    /// The message ends inside a field.
    Short {
        /// Octets that the field takes.
        wanted: u64,
        /// Octets that are left.
        left: usize,
    },
    /// The message is complete, but octets follow.
    Trailing {
        /// How many.
        octets: usize,
    },
    /// It is another message.
    Code {
        /// The code in the octets.
        found: u16,
        /// The code of the message wanted.
        expected: u16,
    },
    /// The presence vector has bits that no member owns.
    Presence {
        /// The vector.
        found: u64,
        /// All the bits that have a meaning.
        defined: u64,
    },
    /// A count of elements or octets outside its limits.
    Count {
        /// The count.
        found: u64,
        /// The least that the definition allows.
        min: u64,
        /// The greatest that the definition allows.
        max: u64,
    },
    /// A variant's tag beyond its alternatives.
    Tag {
        /// The tag.
        found: u64,
        /// How many alternatives there are.
        alternatives: u64,
    },
    /// A `variable_field` whose index chooses nothing.
    Choice {
        /// The index.
        found: u8,
    },
}

/// What is wrong with the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeErrorKind {
    /// More or fewer elements or octets than the definition allows.
    Count {
        /// How many there are.
        found: u64,
        /// The least that the definition allows.
        min: u64,
        /// The greatest that the definition allows.
        max: u64,
    },
}

/// A cause and where it was met.
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

    /// `NodeList[2].NodeID`.
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

            /// Adds the member in which the error was met.
            #[doc(hidden)]
            #[cold]
            #[inline(never)]
            #[must_use]
            pub fn within(mut self, member: &'static str) -> Self {
                self.0.path.push(Step::Member(member));
                self
            }

            /// Adds the index of the element in which the error was met.
            #[doc(hidden)]
            #[cold]
            #[inline(never)]
            #[must_use]
            pub fn element(mut self, index: usize) -> Self {
                self.0.path.push(Step::Element(index));
                self
            }

            /// Adds the message in which the error was met.
            #[cold]
            #[inline(never)]
            #[must_use]
            pub(crate) fn of(mut self, name: &'static str, code: u16) -> Self {
                self.0.message = Some((name, code));
                self
            }

            /// What is wrong.
            pub fn kind(&self) -> $kind {
                self.0.kind
            }

            /// The octet, counted from 0 at the message's code, where the field begins.
            pub fn offset(&self) -> usize {
                self.0.offset
            }

            /// The message's name, as its definition spells it.
            pub fn message(&self) -> Option<&'static str> {
                self.0.message.map(|(name, _)| name)
            }

            /// The way to the field in JSIDL names, such as `NodeList[2].NodeID`; empty if the
            /// message as a whole is meant.
            pub fn path(&self) -> String {
                self.0.path()
            }
        }

        impl std::error::Error for $error {}

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
