//! Wire layout of a message as a table: every field with its offset if that is fixed, its octets,
//! type, unit and values.

use super::block::{Cell, Inline, Line, Row, Table, code, muted, text};
use super::values;
use crate::model::{
    BitField, Choice, Count, Group, Item, List, Message, Number, Scalar, Shape, Unsigned, Variant,
};

const HEAD: [&str; 6] = ["Offset", "Octets", "Field", "Type", "Unit", "Values"];

/// The table of a message.
pub(super) fn table(message: &Message) -> Table {
    let mut layout = Layout {
        rows: Vec::new(),
        offset: Offset::Fixed(0),
    };
    let value = vec![vec![code(format!("{:04X}h", message.code))]];
    layout.push(
        0,
        Entry {
            octets: Octets::Fixed(2),
            field: vec![muted("message code")],
            kind: Number::Unsigned(Unsigned::U16).name(),
            values: value,
            ..Entry::default()
        },
    );
    let sections = [&message.header, &message.body, &message.footer];
    for section in sections.into_iter().flatten() {
        layout.shape(section, "", 0);
    }
    Table {
        class: "layout",
        head: &HEAD,
        rows: layout.rows,
    }
}

/// Start of a field.
#[derive(Clone, Copy, PartialEq)]
enum Offset {
    /// Octets from the message code.
    Fixed(u64),
    /// Octets from the start of the list's element.
    Within(u64),
    /// Depends on preceding fields.
    Open,
}

impl Offset {
    fn after(self, octets: &Octets) -> Self {
        match (self, octets) {
            (offset, Octets::None) => offset,
            (Self::Fixed(n), Octets::Fixed(size)) => Self::Fixed(n.saturating_add(*size)),
            (Self::Within(n), Octets::Fixed(size)) => Self::Within(n.saturating_add(*size)),
            _ => Self::Open,
        }
    }

    fn shown(self) -> Line {
        match self {
            Self::Fixed(n) => vec![text(n.to_string())],
            Self::Within(n) => vec![muted(format!("+{n}"))],
            Self::Open => vec![muted("…")],
        }
    }
}

/// Size of a field in octets.
#[derive(Clone, Default)]
enum Octets {
    /// None of its own.
    #[default]
    None,
    /// Constant.
    Fixed(u64),
    /// Given by its count.
    Counted,
}

/// Content of a row.
#[derive(Default)]
struct Entry {
    octets: Octets,
    field: Line,
    /// The author's text.
    words: String,
    kind: &'static str,
    unit: String,
    values: Cell,
    optional: Option<usize>,
}

struct Layout {
    rows: Vec<Row>,
    offset: Offset,
}

impl Layout {
    fn push(&mut self, depth: usize, entry: Entry) {
        let (offset, octets) = match &entry.octets {
            Octets::None => (vec![], vec![]),
            Octets::Fixed(n) => (self.offset.shown(), vec![text(n.to_string())]),
            Octets::Counted => (self.offset.shown(), vec![muted("count")]),
        };
        let mut field = entry.field;
        if let Some(bit) = entry.optional {
            field.extend([
                text(" "),
                Inline::Badge("optional"),
                muted(format!(" bit {bit}")),
            ]);
        }
        let mut field = vec![field];
        if !entry.words.is_empty() {
            field.push(vec![muted(entry.words)]);
        }
        let unit = if entry.unit == "one" {
            String::new()
        } else {
            entry.unit
        };
        self.rows.push(Row {
            depth,
            heading: false,
            cells: vec![
                vec![offset],
                vec![octets],
                field,
                vec![filled(entry.kind)],
                vec![filled(&unit)],
                entry.values,
            ],
        });
        self.offset = self.offset.after(&entry.octets);
        if entry.optional.is_some() {
            self.offset = Offset::Open;
        }
    }

    /// A heading of a repeated element or an alternative.
    fn title(&mut self, depth: usize, words: Line) {
        let mut cells = vec![Vec::new(); HEAD.len()];
        cells[2] = vec![words];
        self.rows.push(Row {
            depth,
            heading: true,
            cells,
        });
    }

    fn shape(&mut self, item: &Item, path: &str, depth: usize) {
        match &item.shape {
            Shape::Group(group) => self.group(group, path, depth),
            Shape::List(list) => self.list(list, path, depth),
            Shape::Variant(variant) => self.variant(variant, path, depth),
            _ => self.field(item, path, depth, None),
        }
    }

    fn group(&mut self, group: &Group, path: &str, depth: usize) {
        if let Some(width) = group.presence {
            let optional = group.members.iter().filter(|member| member.optional);
            let bits = optional.enumerate();
            let bits =
                bits.map(|(bit, member)| vec![text(format!("bit {bit} ")), code(&member.name)]);
            self.push(
                depth,
                Entry {
                    octets: Octets::Fixed(width.size() as u64),
                    field: labelled(path, "presence vector"),
                    kind: Number::Unsigned(width).name(),
                    values: bits.collect(),
                    ..Entry::default()
                },
            );
        }
        let mut bits = 0..;
        for member in &group.members {
            let bit = member.optional.then(|| bits.next()).flatten();
            self.member(member, path, depth, bit);
        }
    }

    /// A member of a group; composites get a row of their own.
    fn member(&mut self, item: &Item, path: &str, depth: usize, bit: Option<usize>) {
        let composite = matches!(
            item.shape,
            Shape::Group(_) | Shape::List(_) | Shape::Variant(_)
        );
        if !composite {
            self.field(item, path, depth, bit);
            return;
        }
        let path = joined(path, &item.name);
        let mut words = named(&path);
        if let Some(bit) = bit {
            words.extend([
                text(" "),
                Inline::Badge("optional"),
                muted(format!(" bit {bit}")),
            ]);
        }
        self.title(depth, words);
        let before = self.offset;
        self.shape(item, &path, depth + 1);
        if bit.is_some() && self.offset != before {
            self.offset = Offset::Open;
        }
    }

    fn list(&mut self, list: &List, path: &str, depth: usize) {
        self.count(&list.count, path, depth, "elements");
        let element = format!("{path}[]");
        self.title(
            depth,
            vec![muted("each element, repeated as the count says")],
        );
        let start = Offset::Within(0);
        self.offset = start;
        self.shape(&list.element, &element, depth + 1);
        self.offset = Offset::Open;
    }

    fn variant(&mut self, variant: &Variant, path: &str, depth: usize) {
        let alternatives = variant.alternatives.iter().enumerate();
        let names = alternatives.map(|(tag, item)| vec![text(format!("{tag} ")), code(&item.name)]);
        self.push(
            depth,
            Entry {
                octets: Octets::Fixed(variant.tag.size() as u64),
                field: labelled(path, "tag"),
                kind: Number::Unsigned(variant.tag).name(),
                values: names.collect(),
                ..Entry::default()
            },
        );
        let start = self.offset;
        let mut ends = Vec::new();
        for (tag, item) in variant.alternatives.iter().enumerate() {
            self.offset = start;
            let path = joined(path, &item.name);
            let mut words = vec![muted(format!("if the tag is {tag}: "))];
            words.extend(named(&path));
            self.title(depth, words);
            self.shape(item, &path, depth + 1);
            ends.push(self.offset);
        }
        let same = ends.windows(2).all(|pair| pair[0] == pair[1]);
        self.offset = match ends.first() {
            Some(&end) if same => end,
            Some(_) => Offset::Open,
            None => start,
        };
    }

    fn field(&mut self, item: &Item, path: &str, depth: usize, bit: Option<usize>) {
        let path = joined(path, &item.name);
        let entry = Entry {
            field: named(&path),
            words: item.interpretation.clone(),
            optional: bit,
            ..Entry::default()
        };
        match &item.shape {
            Shape::Scalar(scalar) => self.push(depth, number(entry, scalar)),
            Shape::Bits(bits) => self.bits(entry, bits, depth),
            Shape::FixedString { length } => self.push(
                depth,
                Entry {
                    octets: Octets::Fixed(u64::from(*length)),
                    kind: "text",
                    values: vec![vec![text("zeros after it")]],
                    ..entry
                },
            ),
            Shape::VariableString { count } => self.counted(entry, count, &path, depth, "text"),
            Shape::Blob { count, format } => {
                let values = vec![vec![text(format)]];
                self.counted(Entry { values, ..entry }, count, &path, depth, "octets");
            }
            Shape::FormattedBlob { formats, count } => {
                let known = formats.iter();
                let known = known.map(|f| vec![text(format!("{} ", f.index)), code(&f.name)]);
                self.push(
                    depth,
                    Entry {
                        octets: Octets::Fixed(1),
                        field: labelled(&path, "format"),
                        kind: Number::Unsigned(Unsigned::U8).name(),
                        values: known.collect(),
                        ..Entry::default()
                    },
                );
                self.counted(entry, count, &path, depth, "octets");
            }
            Shape::Measure { choices } => self.measure(entry, choices, &path, depth),
            Shape::Array(array) => {
                let sizes: Vec<_> = array.dimensions.iter().map(u32::to_string).collect();
                let words = format!(
                    "{} elements, the first dimension fastest",
                    sizes.join(" × ")
                );
                self.title(
                    depth,
                    [named(&path), vec![muted(format!(" {words}"))]].concat(),
                );
                let (before, elements) = (self.offset, array.elements());
                self.offset = Offset::Within(0);
                self.shape(&array.element, &format!("{path}[]"), depth + 1);
                self.offset = match self.offset {
                    Offset::Within(size) if bit.is_none() => {
                        before.after(&Octets::Fixed(size.saturating_mul(elements)))
                    }
                    _ => Offset::Open,
                };
            }
            Shape::Group(_) | Shape::List(_) | Shape::Variant(_) => {}
        }
    }

    fn bits(&mut self, entry: Entry, bits: &BitField, depth: usize) {
        self.push(
            depth,
            Entry {
                octets: Octets::Fixed(bits.base.size() as u64),
                kind: Number::Unsigned(bits.base).name(),
                values: vec![vec![muted("bit field")]],
                ..entry
            },
        );
        for field in &bits.fields {
            let range = match field.to {
                to if to == field.from => format!("bit {to} "),
                to => format!("bits {} to {to} ", field.from),
            };
            self.push(
                depth + 1,
                Entry {
                    field: vec![muted(range), code(&field.name)],
                    words: field.interpretation.clone(),
                    values: values::of_set(&field.values),
                    ..Entry::default()
                },
            );
        }
    }

    fn measure(&mut self, entry: Entry, choices: &[Choice], path: &str, depth: usize) {
        let known = choices.iter().map(|choice| {
            let name = choice.name.as_deref().unwrap_or(&choice.scalar.units);
            vec![text(format!("{} ", choice.index)), code(name)]
        });
        let index = Octets::Fixed(1);
        let start = self.offset.after(&index);
        self.push(
            depth,
            Entry {
                octets: index,
                field: labelled(path, "index"),
                kind: Number::Unsigned(Unsigned::U8).name(),
                values: known.collect(),
                optional: entry.optional,
                words: entry.words,
                ..Entry::default()
            },
        );
        for choice in choices {
            self.offset = start;
            let mut field = vec![muted(format!("if the index is {}: ", choice.index))];
            field.extend(named(path));
            let entry = Entry {
                field,
                ..Entry::default()
            };
            self.push(depth + 1, number(entry, &choice.scalar));
        }
        self.offset = Offset::Open;
    }

    /// A count, and the counted content.
    fn counted(
        &mut self,
        entry: Entry,
        count: &Count,
        path: &str,
        depth: usize,
        kind: &'static str,
    ) {
        self.count(count, path, depth, "octets");
        self.push(
            depth,
            Entry {
                octets: Octets::Counted,
                kind,
                ..entry
            },
        );
    }

    fn count(&mut self, count: &Count, path: &str, depth: usize, what: &str) {
        let limits = match (count.min, count.max) {
            (0, max) if max == count.unsigned.max() => format!("how many {what}"),
            (0, max) => format!("at most {max} {what}"),
            (min, max) if min == max => format!("{min} {what}"),
            (min, max) if max == count.unsigned.max() => format!("at least {min} {what}"),
            (min, max) => format!("{min} to {max} {what}"),
        };
        self.push(
            depth,
            Entry {
                octets: Octets::Fixed(count.unsigned.size() as u64),
                field: labelled(path, "count"),
                kind: Number::Unsigned(count.unsigned).name(),
                values: vec![vec![text(limits)]],
                ..Entry::default()
            },
        );
    }
}

fn number(entry: Entry, scalar: &Scalar) -> Entry {
    Entry {
        octets: Octets::Fixed(scalar.number.size() as u64),
        kind: scalar.number.name(),
        unit: scalar.units.clone(),
        values: values::of(scalar),
        ..entry
    }
}

fn filled(words: &str) -> Line {
    if words.is_empty() {
        Vec::new()
    } else {
        vec![text(words)]
    }
}

fn joined(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}

/// A path with its last part emphasised.
fn named(path: &str) -> Line {
    match path.rfind('.') {
        Some(dot) => vec![muted(&path[..=dot]), code(&path[dot + 1..])],
        None => vec![code(path)],
    }
}

/// A part of a field that is not its value.
fn labelled(path: &str, what: &str) -> Line {
    let mut line = if path.is_empty() {
        Vec::new()
    } else {
        let mut line = named(path);
        line.push(text(" "));
        line
    };
    line.push(muted(what));
    line
}
