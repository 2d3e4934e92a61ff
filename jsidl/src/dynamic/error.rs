//! Errors of octets and values, with the path to the field.
//!
//! Every error names the message, the path to the field and, when decoding, the offset of the field
//! (from 0 at the message code).

use std::fmt;

use super::Raw;

/// The path from a message to a field, for example `NodeList[0].ComponentList[2].URI`.
///
/// It follows the JSON view: the body's own composite is left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Path(Vec<Step>);

/// One step of a [`Path`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// To a member of a group, or to an alternative of a variant.
    Member(String),
    /// To an element of a list or array, counted from 0.
    Element(usize),
}

impl Path {
    /// The steps, outermost first; none for the message itself.
    pub fn steps(&self) -> &[Step] {
        &self.0
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (position, step) in self.0.iter().enumerate() {
            match step {
                Step::Member(name) if position == 0 => write!(f, "{name}")?,
                Step::Member(name) => write!(f, ".{name}")?,
                Step::Element(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// Octets that are not a message of the given definition.
#[derive(Debug, Clone, PartialEq)]
pub struct DecodeError {
    /// The message's name.
    pub message: String,
    /// The field.
    pub path: Path,
    /// The octet at which the offending item begins, from 0.
    pub offset: usize,
    /// The problem.
    pub problem: DecodeProblem,
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, &self.message, &self.path)?;
        write!(f, "{} at octet {}", self.problem, self.offset)
    }
}

impl std::error::Error for DecodeError {}

/// Problems of octets.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeProblem {
    /// The code of another message.
    #[error("message code {found:04X}h, expected {expected:04X}h")]
    Code {
        /// The definition's code.
        expected: u16,
        /// The code in the octets.
        found: u16,
    },
    /// The octets end too early.
    #[error("octets needed: {needed}, left: {left}")]
    Short {
        /// Octets that the item takes.
        needed: u64,
        /// Remaining octets.
        left: usize,
    },
    /// Octets follow the message.
    #[error("octets after the end of the message: {left}")]
    Trailing {
        /// Their number.
        left: usize,
    },
    /// The presence vector has bits that belong to no member.
    #[error("presence vector {vector:#x} has undefined bits {undefined:#x}")]
    Presence {
        /// The whole vector.
        vector: u64,
        /// The bits in question.
        undefined: u64,
    },
    /// A count outside the limits of the definition.
    #[error("count {count} is outside {min} to {max}")]
    Count {
        /// The count in the octets.
        count: u64,
        /// The least allowed.
        min: u64,
        /// The greatest allowed.
        max: u64,
    },
    /// The tag of a variant names no alternative.
    #[error("tag {tag} selects none of the variant's {alternatives} alternatives")]
    Tag {
        /// The tag in the octets.
        tag: u64,
        /// Number of alternatives.
        alternatives: usize,
    },
    /// The index of a `variable_field` names no type.
    #[error("index {index} selects none of the field's types and units")]
    Index {
        /// The index in the octets.
        index: u8,
    },
    /// More elements without octets than one message may hold.
    #[error(
        "more than {} elements that take no octets",
        super::MOST_EMPTY_ELEMENTS
    )]
    EmptyElements,
}

/// A value that its definition cannot express.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodeError {
    /// The message's name.
    pub message: String,
    /// The field.
    pub path: Path,
    /// The problem.
    pub problem: EncodeProblem,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, &self.message, &self.path)?;
        self.problem.fmt(f)
    }
}

impl std::error::Error for EncodeError {}

/// Problems of a value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeProblem {
    /// A value of another kind than the definition requires.
    #[error("{found}, but the definition has {expected}")]
    Kind {
        /// The required kind.
        expected: &'static str,
        /// The actual kind.
        found: &'static str,
    },
    /// A group or array with a wrong number of slots or elements.
    #[error("{found} slots, but the definition has {expected}")]
    Slots {
        /// The number in the definition.
        expected: u64,
        /// The number in the value.
        found: usize,
    },
    /// A required member is absent.
    #[error("the member is required")]
    Missing,
    /// An optional member is present for which the presence vector has no bit.
    #[error("the presence vector has no bit for the member")]
    NoPresenceBit,
    /// A number that does not fit its type.
    #[error("{number} does not fit {kind}")]
    Number {
        /// The number.
        number: Raw,
        /// The type in the language's words.
        kind: &'static str,
    },
    /// A count outside the limits of the definition or of its type.
    #[error("count {count} is outside {min} to {max}")]
    Count {
        /// The number of elements or octets.
        count: u64,
        /// The least allowed.
        min: u64,
        /// The greatest allowed.
        max: u64,
    },
    /// A string that is longer than its field.
    #[error("{length} octets of text in a field of {field}")]
    TooLong {
        /// Octets in the text.
        length: usize,
        /// Octets in the field.
        field: u32,
    },
    /// The tag of a variant names no alternative, or its value is absent.
    #[error("tag {tag} selects none of the variant's {alternatives} alternatives")]
    Tag {
        /// The tag.
        tag: u64,
        /// Number of alternatives.
        alternatives: usize,
    },
    /// The index of a `variable_field` names no type.
    #[error("index {index} selects none of the field's types and units")]
    Index {
        /// The index.
        index: u8,
    },
    /// More elements without octets than one message may hold.
    #[error(
        "more than {} elements that take no octets",
        super::MOST_EMPTY_ELEMENTS
    )]
    EmptyElements,
    /// Two members of one group have the same name, so that JSON cannot tell them apart.
    #[error("the definition has two members of this name, which JSON cannot distinguish")]
    SameName,
}

pub(super) fn write_place(f: &mut fmt::Formatter<'_>, message: &str, path: &Path) -> fmt::Result {
    write!(f, "{message}: ")?;
    if !path.0.is_empty() {
        write!(f, "{path}: ")?;
    }
    Ok(())
}

/// A problem that is being returned: each level adds a step.
#[derive(Debug)]
pub(crate) struct Fault<P> {
    problem: P,
    offset: usize,
    /// Innermost first.
    steps: Vec<Step>,
}

impl<P> Fault<P> {
    pub(super) const fn at(offset: usize, problem: P) -> Self {
        Self {
            problem,
            offset,
            steps: Vec::new(),
        }
    }

    pub(crate) fn under(mut self, step: Step) -> Self {
        self.steps.push(step);
        self
    }

    pub(crate) fn member(self, name: &str) -> Self {
        self.under(Step::Member(name.to_owned()))
    }

    pub(super) fn path(mut self) -> (Path, usize, P) {
        self.steps.reverse();
        (Path(self.steps), self.offset, self.problem)
    }
}

impl<P> From<P> for Fault<P> {
    fn from(problem: P) -> Self {
        Self::at(0, problem)
    }
}

impl Fault<DecodeProblem> {
    pub(super) fn decoding(self, message: &str) -> DecodeError {
        let (path, offset, problem) = self.path();
        DecodeError {
            message: message.to_owned(),
            path,
            offset,
            problem,
        }
    }
}

impl Fault<EncodeProblem> {
    pub(crate) fn encoding(self, message: &str) -> EncodeError {
        let (path, _, problem) = self.path();
        EncodeError {
            message: message.to_owned(),
            path,
            problem,
        }
    }
}
