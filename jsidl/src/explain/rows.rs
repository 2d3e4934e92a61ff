//! Creates the rows of a message while the decoder reads it.

use std::ops::Range;

use super::{Kind, Row};
use crate::dynamic::trace::{Part, Place, Trace};
use crate::dynamic::{Raw, Steps};
use crate::model::{
    BitField, Choice, Count, Format, Group, Item, Meaning, Scalar, Unsigned, ValueRange, ValueSet,
    Variant, is_message_format,
};

/// Creates a row for every traced part.
pub(super) struct Recorder<'m, 'a> {
    octets: &'a [u8],
    rows: &'a mut Vec<Row>,
    /// The levels from the message down to the current position.
    levels: Vec<Level<'m>>,
    path: String,
}

/// State of a level while its members are read.
#[derive(Default)]
struct Level<'m> {
    /// Length of the path up to here.
    path: usize,
    /// The group whose presence vector was read.
    group: Option<&'m Group>,
}

impl<'a> Recorder<'_, 'a> {
    pub(super) fn new(octets: &'a [u8], rows: &'a mut Vec<Row>) -> Self {
        Self {
            octets,
            rows,
            levels: vec![Level::default()],
            path: String::new(),
        }
    }

    fn bits(&mut self, definition: &BitField, raw: u64, start: usize) {
        let mut reserved = raw;
        for field in &definition.fields {
            let value = (raw & field.mask())
                .checked_shr(field.from.into())
                .unwrap_or(0);
            reserved &= !field.mask();
            let path = joined(&self.path, &field.name);
            let row = Row::new(Kind::SubField, path, start, &[]).with_number(value);
            let bits = match field.to {
                to if to == field.from => format!("bit {to}"),
                to => format!("bits {} to {to}", field.from),
            };
            self.rows
                .push(named(row, &field.values, Raw::Unsigned(value)).noting(bits));
        }
        if reserved != 0 {
            let row = Row::new(Kind::SubField, joined(&self.path, "_reserved"), start, &[]);
            let note = "bits outside all sub-fields, in place";
            self.rows.push(row.with_number(reserved).with_note(note));
        }
    }
}

impl<'m> Trace<'m> for Recorder<'m, '_> {
    fn read(&mut self, octets: Range<usize>, part: Part<'m>) {
        let start = octets.start;
        let octets = self.octets.get(octets).unwrap_or_default();
        let row = |kind| Row::new(kind, self.path.clone(), start, octets);
        let row = match part {
            Part::Code(message) => row(Kind::Code)
                .with_number(message.code.into())
                .with_name(&message.name),
            Part::Presence(group, width, vector) => {
                if let Some(level) = self.levels.last_mut() {
                    level.group = Some(group);
                }
                presence(row(Kind::Presence), group, width, vector)
            }
            Part::Count(count, number) => counted(row(Kind::Count), count, number),
            Part::Tag(variant, tag) => chosen(row(Kind::Tag), variant, tag),
            Part::Format(formats, index) => format(row(Kind::Format), formats, index),
            Part::Index(choice) => index(row(Kind::Index), choice),
            Part::Number(scalar, raw) => number(row(Kind::Value), scalar, raw),
            Part::Bits(_, raw) => row(Kind::Bits).with_number(raw),
            Part::Text => text(row(Kind::Value), octets),
            Part::Octets(format) if is_message_format(format) && !octets.is_empty() => {
                row(Kind::Message).with_note("unknown message")
            }
            Part::Octets(_) => row(Kind::Value).with_note(match octets.len() {
                0 => "empty".to_owned(),
                1 => "1 octet".to_owned(),
                n => format!("{n} octets"),
            }),
        };
        self.rows.push(row);
        if let Part::Bits(definition, raw) = part {
            self.bits(definition, raw, start);
        }
    }

    fn absent(&mut self, member: &'m Item) {
        let group = self.levels.last().and_then(|level| level.group);
        let bit = group.and_then(|group| {
            let mut optional = group.members.iter().filter(|item| item.optional);
            optional.position(|item| std::ptr::eq(item, member))
        });
        let offset = self
            .rows
            .last()
            .map_or(0, |row| row.offset + row.octets.len());
        let row = Row::new(Kind::Absent, joined(&self.path, &member.name), offset, &[]);
        self.rows.push(row.with_note(match bit {
            Some(bit) => format!("absent: bit {bit} of the presence vector is 0"),
            None => "absent".to_owned(),
        }));
    }

    fn enter(&mut self, place: Place<'m>) {
        self.levels.push(Level {
            path: self.path.len(),
            group: None,
        });
        match place {
            Place::Member(item) => self.path = joined(&self.path, &item.name),
            Place::Element(index) => self.path.push_str(&format!("[{index}]")),
        }
    }

    fn leave(&mut self) {
        if let Some(level) = self.levels.pop() {
            self.path.truncate(level.path);
        }
    }
}

impl Row {
    /// Adds a note after the existing one.
    fn noting(mut self, note: String) -> Self {
        self.note = Some(match self.note {
            Some(before) => format!("{before}; {note}"),
            None => note,
        });
        self
    }
}

pub(super) fn joined(path: &str, name: &str) -> String {
    match (path, name) {
        ("", inner) | (inner, "") => inner.to_owned(),
        _ => format!("{path}.{name}"),
    }
}

fn presence(row: Row, group: &Group, width: Unsigned, vector: u64) -> Row {
    let optional = group.members.iter().filter(|item| item.optional);
    let present: Vec<_> = optional
        .enumerate()
        .filter(|&(bit, _)| vector.checked_shr(bit as u32).unwrap_or(0) & 1 == 1)
        .map(|(_, item)| item.name.as_str())
        .collect();
    let optional = group.members.iter().filter(|item| item.optional).count();
    let row = row.with_number(vector);
    match present.len() {
        0 => row.with_note(format!("none of {optional} optional members follows")),
        n if n == optional => row.with_note("all optional members follow"),
        // List small vectors completely; for large ones the following rows are enough.
        _ if width == Unsigned::U8 => row.with_note(format!("with {}", present.join(", "))),
        n => row.with_note(format!("{n} of {optional} optional members follow")),
    }
}

fn counted(row: Row, count: &Count, number: u64) -> Row {
    let row = row.with_number(number);
    if (count.min..=count.max).contains(&number) {
        return row;
    }
    row.with_note(format!(
        "outside of the definition's {} to {}",
        count.min, count.max
    ))
}

fn chosen(row: Row, variant: &Variant, tag: u64) -> Row {
    let row = row.with_number(tag);
    let chosen = usize::try_from(tag).ok();
    match chosen.and_then(|tag| variant.alternatives.get(tag)) {
        Some(item) => row.with_name(&item.name),
        None => row.with_note("there are no alternatives"),
    }
}

fn format(row: Row, formats: &[Format], index: u8) -> Row {
    let row = row.with_number(index.into());
    match formats.iter().find(|format| format.index == index) {
        Some(format) => row.with_name(&format.name),
        None => row.with_note("none of the formats of the definition"),
    }
}

fn index(row: Row, choice: &Choice) -> Row {
    let number = choice.scalar.number.name();
    let row = row.with_number(choice.index.into());
    match &choice.name {
        Some(name) => row.with_name(name),
        None => row.with_name(format!("{number} in {}", choice.scalar.units)),
    }
}

fn number(mut row: Row, scalar: &Scalar, raw: Raw) -> Row {
    row.raw = Some(raw);
    row.units = (scalar.units != "one" && !scalar.units.is_empty()).then(|| scalar.units.clone());
    match (&scalar.meaning, scalar.number, raw) {
        (Meaning::Scaled(scale), number, raw) => {
            row.real = Steps::of(scale, number).and_then(|steps| steps.shown(raw));
            row
        }
        (Meaning::Values(values), _, raw) => named(row, values, raw),
        _ => row,
    }
}

/// The name of an enumerated value, or a note that it has none.
fn named(row: Row, values: &ValueSet, raw: Raw) -> Row {
    let index = match raw {
        Raw::Unsigned(n) => Some(n.into()),
        Raw::Signed(n) => Some(n.into()),
        Raw::F32(_) | Raw::F64(_) => None,
    };
    let known = values.values.iter().find(|v| Some(v.index) == index);
    if let Some(known) = known {
        return row.with_name(&known.name);
    }
    let number = match raw {
        Raw::Unsigned(n) => n as f64,
        Raw::Signed(n) => n as f64,
        Raw::F32(n) => n.into(),
        Raw::F64(n) => n,
    };
    let unlimited = values.values.is_empty() && values.ranges.is_empty();
    if unlimited || values.ranges.iter().any(|range| contains(range, number)) {
        return row;
    }
    row.with_note("none of the values of the definition")
}

fn contains(range: &ValueRange, number: f64) -> bool {
    let below = number < range.lower || range.lower_exclusive && number == range.lower;
    let above = number > range.upper || range.upper_exclusive && number == range.upper;
    !below && !above
}

fn text(row: Row, octets: &[u8]) -> Row {
    let end = octets.iter().rposition(|&octet| octet != 0);
    let content = &octets[..end.map_or(0, |last| last + 1)];
    let padding = octets.len() - content.len();
    let row = match std::str::from_utf8(content) {
        Ok(text) => row.with_name(format!("{text:?}")),
        Err(_) => row.with_note("not UTF-8"),
    };
    match padding {
        0 => row,
        1 => row.noting("1 zero after it".to_owned()),
        n => row.noting(format!("{n} zeros after it")),
    }
}
