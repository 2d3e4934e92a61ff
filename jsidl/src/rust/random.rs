//! Generates `Arbitrary`: random valid values for tests.

use super::structs::optional;
use super::types::{Field, Type};
use super::writer::Writer;
use crate::model::{Count, Number};

/// Writes `Arbitrary` for a struct.
pub(super) fn group(out: &mut Writer, ident: &str, fields: &[Field<'_>]) {
    begin(out, ident, if fields.is_empty() { "_" } else { "random" });
    if fields.is_empty() {
        out.push("Ok(Self)");
    } else {
        out.push("Ok(Self {");
        for field in fields {
            let value = value(&field.ty);
            let value = if optional(field) {
                format!("codec::arbitrary::optional(random, {})", maker(&field.ty))
            } else {
                value
            };
            out.push(format!("{}: {value}?,", field.ident));
        }
        out.push("})");
    }
    out.push("}\n}\n}");
}

/// Writes `Arbitrary` for an enum whose alternatives each hold one value.
pub(super) fn one_of<'t>(
    out: &mut Writer,
    ident: &str,
    alternatives: impl ExactSizeIterator<Item = (&'t str, &'t Type)>,
) {
    begin(out, ident, "random");
    let last = alternatives.len().saturating_sub(1);
    out.push(format!("match random.int_in_range(0..={last})? {{"));
    for (position, (variant, ty)) in alternatives.enumerate() {
        let pattern = if position == last {
            "_".to_owned()
        } else {
            position.to_string()
        };
        out.push(format!("{pattern} => {}.map(Self::{variant}),", value(ty)));
    }
    out.push("}\n}\n}\n}");
}

fn begin(out: &mut Writer, ident: &str, random: &str) {
    out.gap();
    out.push("codec::if_arbitrary! {");
    out.push(format!(
        "impl<'a> codec::arbitrary::Arbitrary<'a> for {ident} {{"
    ));
    out.push(format!("fn arbitrary({random}: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {{"));
}

/// An expression for a random value, of type `Result`.
fn value(ty: &Type) -> String {
    let counted = |call: &str, count: &Count| {
        format!(
            "codec::arbitrary::{call}(random, {}, {})",
            count.min, count.max
        )
    };
    match ty {
        Type::Number(Number::F32) => "codec::arbitrary::f32(random)".to_owned(),
        Type::Number(Number::F64) => "codec::arbitrary::f64(random)".to_owned(),
        Type::FixedText(length) => format!("codec::arbitrary::fixed_text(random, {length})"),
        Type::Text(count) => counted("text", count),
        Type::Blob(count) => counted("blob", count),
        Type::Formatted { count, .. } => counted("formatted", count),
        Type::List { count, element } => {
            let (min, max, make) = (count.min, count.max, maker(element));
            format!("codec::arbitrary::list(random, {min}, {max}, {make})")
        }
        Type::Array {
            dimensions,
            element,
        } => {
            let array = |make| format!("codec::arbitrary::array(random, {make})");
            let inner = dimensions.iter().skip(1);
            array(inner.fold(maker(element), |make, _| {
                format!("|random| {}", array(make))
            }))
        }
        Type::Number(_) | Type::Newtype { .. } | Type::Record { .. } | Type::Composite { .. } => {
            "codec::arbitrary::Arbitrary::arbitrary(random)".to_owned()
        }
    }
}

/// A function that creates a random value: a path or a closure.
fn maker(ty: &Type) -> String {
    let value = value(ty);
    match value.strip_suffix("(random)") {
        Some(function) => function.to_owned(),
        None => format!("|random| {value}"),
    }
}
