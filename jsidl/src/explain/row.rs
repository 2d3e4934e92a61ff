//! A row of an explanation.

use std::fmt;

use crate::dynamic::Raw;

/// A run of octets with its meaning; or, without octets, additional information.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Offset from the first octet of the input.
    pub offset: usize,
    /// The octets; none for a sub-field of a bit field and for an absent member.
    pub octets: Vec<u8>,
    /// Kind of row.
    pub kind: Kind,
    /// Path of the field, as in errors and in the JSON view, for example `NodeList[0].NodeID`;
    /// empty for the message itself.
    pub field: String,
    /// The number on the wire.
    pub raw: Option<Raw>,
    /// The real value of a scaled integer.
    pub real: Option<f64>,
    /// The units, unless the number is dimensionless.
    pub units: Option<String>,
    /// Name of the value: an enumerated value, a format, the selected alternative; for a string,
    /// the text.
    pub name: Option<String>,
    /// Additional remarks.
    pub note: Option<String>,
}

impl Row {
    /// A row with kind and position only.
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

    /// Sets an unsigned number.
    #[must_use]
    pub fn with_number(mut self, number: u64) -> Self {
        self.raw = Some(Raw::Unsigned(number));
        self
    }

    /// Sets the name of the value.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Adds a note.
    #[must_use]
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = Some(note.into());
        self
    }

    /// The field, with the kind of row where that is not the field's value.
    pub fn label(&self) -> String {
        match (self.kind, self.field.is_empty()) {
            (Kind::Header | Kind::Value | Kind::Bits | Kind::SubField | Kind::Absent, _) => {
                self.field.clone()
            }
            (kind, true) => format!("({kind})"),
            (kind, false) => format!("{} ({kind})", self.field),
        }
    }

    /// The number on the wire as displayed: codes and bit vectors in hexadecimal.
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

    /// The meaning of the number: value with units, name and remarks.
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

/// Kind of a [`Row`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// Transport header.
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
    /// An embedded message that is not explained.
    Message,
    /// The integer of a bit field.
    Bits,
    /// A part of the preceding bit field; it has no octets of its own.
    SubField,
    /// An absent optional member; it has no octets.
    Absent,
    /// Undecoded octets after an error.
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
