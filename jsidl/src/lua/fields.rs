//! Filter fields of the dissector: unique and typed, with one name per meaning.
//!
//! Wireshark allows several fields with one name if their types are compatible. Equal names in one
//! message therefore share the filter name; where the types differ, one of them gets its type
//! appended, as in `jaus.setx.value_text`.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::ops::RangeInclusive;

use super::text;
use crate::model::{NamedValue, Number, Signed, Unsigned};

/// Names below `jaus.` that are reserved for the transport and for fields common to all messages.
const RESERVED: [&str; 31] = [
    "acknowledgement",
    "address",
    "broadcast",
    "code",
    "data",
    "data_control",
    "destination",
    "experimental",
    "fault",
    "fragment",
    "hc_flags",
    "hc_length",
    "hc_number",
    "limits",
    "malformed",
    "message",
    "presence_vector",
    "priority",
    "ra",
    "ra_priority",
    "ra_version",
    "sequence",
    "service",
    "service_connection",
    "size",
    "source",
    "stale",
    "transport",
    "type",
    "unknown",
    "whole_in",
];

/// Value type of a field; if two types claim one name, the lesser gets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Kind {
    /// Unsigned, up to 4 octets.
    Uint,
    /// Unsigned, 8 octets.
    Uint64,
    /// Signed, up to 4 octets.
    Int,
    /// Signed, 8 octets.
    Int64,
    /// A real number, scaled ones included.
    Real,
    /// A string.
    Text,
    /// Raw octets.
    Octets,
    /// A composite, present or absent.
    None,
}

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Self::Uint => "uint",
            Self::Uint64 => "uint64",
            Self::Int => "int",
            Self::Int64 => "int64",
            Self::Real => "real",
            Self::Text => "text",
            Self::Octets => "octets",
            Self::None => "none",
        }
    }

    /// The values that can have a name.
    const fn nameable(self) -> RangeInclusive<i128> {
        match self {
            Self::Int => i32::MIN as i128..=i32::MAX as i128,
            Self::Int64 => i64::MIN as i128..=i64::MAX as i128,
            Self::Uint64 => 0..=u64::MAX as i128,
            _ => 0..=u32::MAX as i128,
        }
    }
}

impl From<Unsigned> for Kind {
    fn from(unsigned: Unsigned) -> Self {
        if unsigned == Unsigned::U64 {
            Self::Uint64
        } else {
            Self::Uint
        }
    }
}

impl From<Number> for Kind {
    fn from(number: Number) -> Self {
        match number {
            Number::Unsigned(unsigned) => unsigned.into(),
            Number::Signed(Signed::I64) => Self::Int64,
            Number::Signed(_) => Self::Int,
            Number::F32 | Number::F64 => Self::Real,
        }
    }
}

/// Filter prefix of a message.
pub(super) fn prefix(message: &str) -> String {
    let name = plain(message);
    if RESERVED.contains(&name.as_str()) {
        format!("jaus.{name}_message")
    } else {
        format!("jaus.{name}")
    }
}

/// Filter prefix of a Reference Architecture message.
pub(super) fn ra_prefix(message: &str) -> String {
    format!("jaus.ra.{}", plain(message))
}

/// Filter name of a field of the message with this prefix.
pub(super) fn within(prefix: &str, field: &str) -> String {
    format!("{prefix}.{}", plain(field))
}

/// Lower case; only letters, digits and `_`.
fn plain(name: &str) -> String {
    let character = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '_'
        }
    };
    name.chars().map(character).collect()
}

/// All fields and their shared tables of value names.
#[derive(Debug, Default)]
pub(super) struct Fields {
    entries: Vec<Entry>,
    places: HashMap<Entry, usize>,
    claims: BTreeMap<String, Kind>,
    settled: bool,
    values: Vec<String>,
    value_places: HashMap<String, usize>,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Entry {
    filter: String,
    name: String,
    kind: Kind,
    values: Option<usize>,
}

impl Fields {
    /// Registers a field and returns its number (from 1); `values` is a number from
    /// [`names`](Self::names).
    pub(super) fn field(
        &mut self,
        filter: String,
        name: &str,
        kind: Kind,
        values: Option<usize>,
    ) -> usize {
        if !self.settled {
            let claim = self.claims.entry(filter).or_insert(kind);
            *claim = kind.min(*claim);
            return 0;
        }
        let filter = if self.claims.get(&filter) == Some(&kind) {
            filter
        } else {
            format!("{filter}_{}", kind.name())
        };
        let entry = Entry {
            filter,
            name: name.to_owned(),
            kind,
            values,
        };
        let next = self.entries.len() + 1;
        let place = *self.places.entry(entry.clone()).or_insert(next);
        if place == next {
            self.entries.push(entry);
        }
        place
    }

    /// Registers a table of named values; returns its number (from 1), or `None` without names.
    pub(super) fn names(&mut self, kind: Kind, values: &[NamedValue]) -> Option<usize> {
        let mut named: BTreeMap<i128, &str> = BTreeMap::new();
        for value in values {
            if kind.nameable().contains(&value.index) {
                named.entry(value.index).or_insert(&value.name);
            }
        }
        self.names_of(named)
    }

    /// As [`names`](Self::names), for numbered values.
    pub(super) fn names_of<'n>(
        &mut self,
        named: impl IntoIterator<Item = (i128, &'n str)>,
    ) -> Option<usize> {
        let entries = named.into_iter();
        let entries: Vec<_> = entries
            .map(|(index, name)| format!("[{index}]={}", text::quoted(name)))
            .collect();
        if entries.is_empty() {
            return None;
        }
        let table = entries.join(",");
        let next = self.values.len() + 1;
        let place = *self.value_places.entry(table.clone()).or_insert(next);
        if place == next {
            self.values.push(table);
        }
        Some(place)
    }

    /// Ends the registration of names.
    pub(super) fn settle(&mut self) {
        self.settled = true;
    }

    /// Writes the tables.
    pub(super) fn write(&self, out: &mut String) {
        out.push_str("local value_names = {\n");
        for table in &self.values {
            // Writing to a string does not fail.
            let _ = writeln!(out, "{{{table}}},");
        }
        out.push_str("}\nlocal field_table = {\n");
        for entry in &self.entries {
            let (filter, name) = (text::quoted(&entry.filter), text::quoted(&entry.name));
            let _ = write!(out, "{{{filter},{name},\"{}\"", entry.kind.name());
            if let Some(values) = entry.values {
                let _ = write!(out, ",{values}");
            }
            out.push_str("},\n");
        }
        out.push_str("}\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lua::RUNTIME;

    #[test]
    fn every_name_of_the_interpreter_is_reserved() {
        let names = RUNTIME[0].split("\"jaus.").skip(1).map(|rest| {
            let end = rest.find(['.', '"']).unwrap_or(rest.len());
            &rest[..end]
        });
        let names: Vec<_> = names.collect();
        assert!(names.len() > 20, "{names:?}");
        for name in names {
            assert!(RESERVED.contains(&name), "{name}");
        }
    }

    #[test]
    fn where_types_differ_the_less_common_one_is_told_apart() {
        let mut fields = Fields::default();
        for settled in [false, true] {
            fields.settled = settled;
            fields.field("jaus.m.f".into(), "F", Kind::None, None);
            fields.field("jaus.m.f".into(), "F", Kind::Real, None);
            fields.field("jaus.m.f".into(), "F", Kind::Real, None);
        }
        let mut out = String::new();
        fields.write(&mut out);
        assert!(
            out.contains("{\"jaus.m.f_none\",\"F\",\"none\"},\n{\"jaus.m.f\",\"F\",\"real\"},\n}")
        );
    }
}
