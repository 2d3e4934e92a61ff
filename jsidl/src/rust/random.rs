//! Generates `Arbitrary`: random valid values for tests.

use super::structs::optional;
use super::types::{Field, Type};
use super::writer::Writer;
use crate::model::{Count, Number};

/// A function that creates a random value of a member; `None` if `Arbitrary` does.
pub(super) fn maker(field: &Field<'_>) -> Option<String> {
    let maker = make(&field.ty);
    if maker == ARBITRARY {
        return None;
    }
    Some(match optional(field) {
        true => format!("|random| codec::arbitrary::optional(random, {maker})"),
        false => maker,
    })
}

const ARBITRARY: &str = "codec::arbitrary::Arbitrary::arbitrary";

/// Writes `Arbitrary` for an enum whose alternatives each hold one value.
pub(super) fn one_of<'t>(
    out: &mut Writer,
    ident: &str,
    alternatives: impl ExactSizeIterator<Item = (&'t str, &'t Type)>,
) {
    begin(out, ident);
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

fn begin(out: &mut Writer, ident: &str) {
    out.gap();
    out.push("codec::if_arbitrary! {");
    out.push(format!(
        "impl<'a> codec::arbitrary::Arbitrary<'a> for {ident} {{"
    ));
    out.push("fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {");
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
            let (min, max, make) = (count.min, count.max, make(element));
            format!("codec::arbitrary::list(random, {min}, {max}, {make})")
        }
        Type::Array { element, .. } => {
            let inwards_out = ty.dimensions().into_iter().rev();
            let make = inwards_out.fold(make(element), |make, dimension| {
                format!(
                    "|random| codec::arbitrary::{}(random, {make})",
                    dimension.random()
                )
            });
            make.trim_start_matches("|random| ").to_owned()
        }
        Type::Number(_) | Type::Newtype { .. } | Type::Record { .. } | Type::Composite { .. } => {
            format!("{ARBITRARY}(random)")
        }
    }
}

/// A function that creates a random value: a path or a closure.
fn make(ty: &Type) -> String {
    let value = value(ty);
    match value.strip_suffix("(random)") {
        Some(function) => function.to_owned(),
        None => format!("|random| {value}"),
    }
}
