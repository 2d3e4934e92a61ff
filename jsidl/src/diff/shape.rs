//! Compares fields: types, scales, units, named values, bits, lengths, choices.

use super::Walk;
use crate::model::{
    BitField, Choice, Count, Format, Meaning, NamedValue, Number, Rounding, Scalar, Scale, Shape,
    Unsigned, ValueRange, ValueSet,
};

impl Walk<'_> {
    pub(super) fn field(&mut self, old: &Shape, new: &Shape) {
        match (old, new) {
            (Shape::Scalar(old), Shape::Scalar(new)) => self.scalar(old, new),
            (Shape::Bits(old), Shape::Bits(new)) => self.bits(old, new),
            (Shape::FixedString { length: old }, Shape::FixedString { length: new }) => {
                self.value(true, "the length", old, new);
            }
            (Shape::VariableString { count: old }, Shape::VariableString { count: new }) => {
                self.count(*old, *new);
            }
            (
                Shape::Blob { count, format },
                Shape::Blob {
                    count: new_count,
                    format: new_format,
                },
            ) => {
                self.count(*count, *new_count);
                self.value(false, "the format", &quoted(format), &quoted(new_format));
            }
            (
                Shape::FormattedBlob { count, formats },
                Shape::FormattedBlob {
                    count: new_count,
                    formats: new_formats,
                },
            ) => {
                self.count(*count, *new_count);
                self.formats(formats, new_formats);
            }
            (Shape::Measure { choices: old }, Shape::Measure { choices: new }) => {
                self.choices(old, new);
            }
            _ => {
                let message = format!("it is now {}, was {}", shape_name(new), shape_name(old));
                self.report(true, message);
            }
        }
    }

    pub(super) fn presence(&mut self, old: Option<Unsigned>, new: Option<Unsigned>) {
        let name = |vector: Option<Unsigned>| {
            vector.map_or("absent".to_owned(), |unsigned| {
                type_name(Number::Unsigned(unsigned))
            })
        };
        self.value(true, "the presence vector", &name(old), &name(new));
    }

    pub(super) fn unsigned(&mut self, what: &str, old: Unsigned, new: Unsigned) {
        self.value(
            true,
            what,
            &type_name(Number::Unsigned(old)),
            &type_name(Number::Unsigned(new)),
        );
    }

    /// The limits are not on the wire.
    pub(super) fn count(&mut self, old: Count, new: Count) {
        self.unsigned("the type of the count", old.unsigned, new.unsigned);
        self.value(false, "the minimum count", &old.min, &new.min);
        let whole = |count: Count| count.max == count.unsigned.max();
        if !(whole(old) && whole(new)) {
            self.value(false, "the maximum count", &old.max, &new.max);
        }
    }

    pub(super) fn dimensions(&mut self, old: &[u32], new: &[u32]) {
        let shown = |sizes: &[u32]| {
            let sizes: Vec<_> = sizes.iter().map(u32::to_string).collect();
            sizes.join(" × ")
        };
        self.value(true, "the size", &shown(old), &shown(new));
    }

    fn scalar(&mut self, old: &Scalar, new: &Scalar) {
        let (was, is) = (type_name(old.number), type_name(new.number));
        self.value(true, "the type", &was, &is);
        self.value(true, "the unit", &quoted(&old.units), &quoted(&new.units));
        match (&old.meaning, &new.meaning) {
            (Meaning::Values(old), Meaning::Values(new)) => self.values(old, new),
            (Meaning::Plain, Meaning::Values(new)) => self.values(&no_values(), new),
            (Meaning::Values(old), Meaning::Plain) => self.values(old, &no_values()),
            (old, new) => {
                let (was, is) = (scale_name(old), scale_name(new));
                self.value(true, "the scale", &was, &is);
            }
        }
    }

    /// A changed index of a name affects the wire; added or removed names do not, as unknown values
    /// are preserved.
    fn values(&mut self, old: &ValueSet, new: &ValueSet) {
        for value in &old.values {
            let name = &value.name;
            // Several values may have one name, such as `Reserved`.
            let stays = |other: &NamedValue| other.name == *name && other.index == value.index;
            if new.values.iter().any(stays) {
                continue;
            }
            if let Some(same) = new.values.iter().find(|other| other.name == *name) {
                let what = format!("the index of the value `{name}`");
                self.value(true, &what, &value.index, &same.index);
            } else if let Some(same) = new.values.iter().find(|o| o.index == value.index) {
                let index = value.index;
                let message = format!("the value {index} is `{}`, was `{name}`", same.name);
                self.report(false, message);
            } else {
                self.report(
                    false,
                    format!("the value {} `{name}` was removed", value.index),
                );
            }
        }
        for value in &new.values {
            let known = |o: &NamedValue| o.name == value.name || o.index == value.index;
            if !old.values.iter().any(known) {
                self.report(
                    false,
                    format!("the value {} `{}` was added", value.index, value.name),
                );
            }
        }
        let (was, is) = (ranges(&old.ranges), ranges(&new.ranges));
        self.value(false, "the allowed range", &was, &is);
    }

    fn bits(&mut self, old: &BitField, new: &BitField) {
        self.unsigned("the type", old.base, new.base);
        for field in &old.fields {
            let name = &field.name;
            let Some(same) = new.fields.iter().find(|other| other.name == *name) else {
                self.report(true, format!("the sub-field `{name}` was removed"));
                continue;
            };
            let place = |from: u8, to: u8| format!("{from} to {to}");
            let what = format!("the place of the bits of `{name}`");
            let (was, is) = (place(field.from, field.to), place(same.from, same.to));
            self.value(true, &what, &was, &is);
            self.part(name.clone(), |walk| {
                walk.values(&field.values, &same.values);
            });
        }
        for field in &new.fields {
            if !old.fields.iter().any(|other| other.name == field.name) {
                self.report(true, format!("the sub-field `{}` was added", field.name));
            }
        }
    }

    fn formats(&mut self, old: &[Format], new: &[Format]) {
        for format in old {
            let index = format.index;
            match new.iter().find(|other| other.index == index) {
                Some(same) => {
                    let what = format!("the format {index}");
                    self.value(true, &what, &quoted(&format.name), &quoted(&same.name));
                }
                None => self.report(
                    true,
                    format!("the format {index} `{}` was removed", format.name),
                ),
            }
        }
        for format in new {
            if !old.iter().any(|other| other.index == format.index) {
                let message = format!("the format {} `{}` was added", format.index, format.name);
                self.report(false, message);
            }
        }
    }

    fn choices(&mut self, old: &[Choice], new: &[Choice]) {
        for choice in old {
            let name = format!("choice {}", choice.index);
            match new.iter().find(|other| other.index == choice.index) {
                Some(same) => {
                    self.part(name, |walk| {
                        walk.scalar(&choice.scalar, &same.scalar);
                    });
                }
                None => self.report(true, format!("the {name} was removed")),
            }
        }
        for choice in new {
            if !old.iter().any(|other| other.index == choice.index) {
                self.report(false, format!("the choice {} was added", choice.index));
            }
        }
    }
}

fn shape_name(shape: &Shape) -> &'static str {
    match shape {
        Shape::FixedString { .. } => "a string of fixed length",
        Shape::VariableString { .. } => "a string of variable length",
        shape => shape.kind(),
    }
}

fn no_values() -> ValueSet {
    ValueSet {
        ranges: Vec::new(),
        values: Vec::new(),
    }
}

fn type_name(number: Number) -> String {
    quoted(number.name())
}

fn quoted(text: &str) -> String {
    format!("`{text}`")
}

fn scale_name(meaning: &Meaning) -> String {
    let Meaning::Scaled(Scale {
        lower,
        upper,
        rounding,
    }) = meaning
    else {
        return "absent".to_owned();
    };
    let rounding = match rounding {
        Rounding::Round => "",
        Rounding::Floor => ", rounded down",
        Rounding::Ceiling => ", rounded up",
    };
    format!("{lower} to {upper}{rounding}")
}

fn ranges(ranges: &[ValueRange]) -> String {
    if ranges.is_empty() {
        return "absent".to_owned();
    }
    let shown: Vec<_> = ranges.iter().map(ValueRange::to_string).collect();
    shown.join(", ")
}
