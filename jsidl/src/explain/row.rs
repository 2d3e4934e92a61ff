//! One line of an explanation.

use std::fmt;

use crate::dynamic::Raw;

/// A run of octets and what it is; or, without octets, something that they say.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Where it begins, counted from 0 at the first octet of the whole input.
    pub offset: usize,
    /// The octets, as many as it takes; none for a sub-field of a bit field and for an absent
    /// member.
    pub octets: Vec<u8>,
    /// What it is.
    pub kind: Kind,
    /// The way to the field that it belongs to, as in errors and in the JSON view, for example
    /// `NodeList[0].NodeID`; empty for the message itself.
    pub field: String,
    /// The number on the wire.
    pub raw: Option<Raw>,
    /// The real number that a scaled integer stands for.
    pub real: Option<f64>,
    /// The units, unless the number is a mere number.
    pub units: Option<String>,
    /// What the value is called: an enumerated value, a format, the chosen alternative; of a
    /// string, the text.
    pub name: Option<String>,
    /// What else there is to know.
    pub note: Option<String>,
}

impl Row {
    /// A row of which nothing is known but what it is and where.
    pub fn new(kind: Kind, field: impl Into<String>, offset: usize, octets: &[u8]) -> Self {
        Self {
            offset,
            octets: octets.to_vec(),
            kind,
            field: field.into(),
            raw: None,
            real: None,
            units: None,
            name: None,
            note: None,
        }
    }

    /// The same with an unsigned number.
    #[must_use]
    pub fn with_number(mut self, number: u64) -> Self {
        self.raw = Some(Raw::Unsigned(number));
        self
    }

    /// The same with a name for its value.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// The same with a note.
    #[must_use]
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = Some(note.into());
        self
    }

    /// The field with what the row is, where that is not simply the field's value.
    pub fn label(&self) -> String {
        match (self.kind, self.field.is_empty()) {
            (Kind::Header | Kind::Value | Kind::Bits | Kind::SubField | Kind::Absent, _) => {
                self.field.clone()
            }
            (kind, true) => format!("({kind})"),
            (kind, false) => format!("{} ({kind})", self.field),
        }
    }

    /// The number on the wire as people read it: codes and vectors of bits in hexadecimal.
    pub fn raw_text(&self) -> String {
        match (self.kind, self.raw) {
            (_, None) => String::new(),
            (Kind::Code, Some(Raw::Unsigned(code))) => format!("{code:04X}h"),
            (Kind::Presence | Kind::Bits, Some(Raw::Unsigned(bits))) => {
                format!("{bits:0width$X}h", width = 2 * self.octets.len())
            }
            (_, Some(raw)) => raw.to_string(),
        }
    }

    /// What the number means: its value with its units, its name, and what else there is to know.
    pub fn meaning(&self) -> String {
        let number = match (self.real, self.kind) {
            (Some(real), _) => Some(real.to_string()),
            (None, Kind::Value | Kind::SubField) if self.name.is_none() => {
                self.raw.map(|raw| raw.to_string())
            }
            _ => None,
        };
        let mut parts = vec![number, self.units.clone(), self.name.clone()];
        parts.retain(Option::is_some);
        let meaning = parts.into_iter().flatten().collect::<Vec<_>>().join(" ");
        match &self.note {
            None => meaning,
            Some(note) if meaning.is_empty() => note.clone(),
            Some(note) => format!("{meaning} ({note})"),
        }
    }
}

/// What a [`Row`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// What the transport puts around a message.
    Header,
    /// The message code.
    Code,
    /// A presence vector.
    Presence,
    /// A count of elements or octets.
    Count,
    /// The tag of a variant.
    Tag,
    /// The index of a `variable_format_field`.
    Format,
    /// The index of a `variable_field`.
    Index,
    /// The value of a field.
    Value,
    /// A message within the message, which is not taken apart.
    Message,
    /// The integer of a bit field.
    Bits,
    /// A part of the bit field before; it has no octets of its own.
    SubField,
    /// An optional member that is not there; it has no octets.
    Absent,
    /// What was not read, because something before it is wrong.
    Unread,
}

impl Kind {
    /// A short name in lower case.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Header => "header",
            Self::Code => "message code",
            Self::Presence => "presence vector",
            Self::Count => "count",
            Self::Tag => "tag",
            Self::Format => "format",
            Self::Index => "index",
            Self::Value => "value",
            Self::Message => "message",
            Self::Bits => "bit field",
            Self::SubField => "sub-field",
            Self::Absent => "absent",
            Self::Unread => "not read",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
