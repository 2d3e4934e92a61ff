//! Generates the encoder: `encoded_len` and `write`.

use super::ident::local;
use super::structs::{Body, optional};
use super::types::{Field, Type, unsigned_type};
use super::writer::Writer;
use crate::model::{Count, Number, Unsigned};

/// The message code, as a value of fixed size.
const CODE: (&str, Type) = (
    "<Self as codec::Message>::CODE",
    Type::Number(Number::Unsigned(Unsigned::U16)),
);

/// Writes `fn encoded_len` and `fn write` of a struct.
pub(super) fn group(out: &mut Writer, body: &Body<'_>) {
    encoded_len(out, body);
    out.gap();
    if body.inlined() {
        out.push("#[inline]");
    }
    write(out, body);
}

fn encoded_len(out: &mut Writer, body: &Body<'_>) {
    let Body {
        fields, presence, ..
    } = body;
    let mut constant = body.code_size() + presence.map_or(0, Unsigned::size);
    let mut terms = Vec::new();
    for field in *fields {
        let value = format!("self.{}", field.ident);
        match (optional(field), constant_len(&field.ty)) {
            (false, Some(size)) => constant += size,
            (false, None) => terms.push(length(&field.ty, &value)),
            (true, Some(size)) => {
                terms.push(times(size, &format!("usize::from({value}.is_some())")));
            }
            (true, None) => {
                let each = measure(&field.ty);
                terms.push(format!("{value}.as_ref().map_or(0, {each})"));
            }
        }
    }
    if constant > 0 || terms.is_empty() {
        terms.insert(0, constant.to_string());
    }
    if let [term] = &*terms {
        return out.push(format!("fn encoded_len(&self) -> usize {{ {term} }}"));
    }
    out.push("fn encoded_len(&self) -> usize {");
    out.terms(&terms, "+ ");
    out.push("}");
}

/// The size of a value in octets, if it is constant.
fn constant_len(ty: &Type) -> Option<usize> {
    match ty {
        Type::FixedText(length) => Some(*length as usize),
        Type::Array {
            dimensions,
            element,
        } => constant_len(element).map(|size| size * dimensions.iter().product::<u32>() as usize),
        _ => ty.size(),
    }
}

/// An expression for the size of a value.
pub(super) fn length(ty: &Type, value: &str) -> String {
    if let Some(size) = constant_len(ty) {
        return size.to_string();
    }
    match ty {
        Type::Text(count) | Type::Blob(count) => {
            format!("{} + {value}.len()", count.unsigned.size())
        }
        Type::Formatted { count, .. } => {
            format!("{} + {value}.data.len()", 1 + count.unsigned.size())
        }
        Type::List { count, element } => {
            let before = count.unsigned.size();
            match constant_len(element) {
                Some(size) => format!("{before} + {}", times(size, &format!("{value}.len()"))),
                None => format!("{before} + {}", total(&format!("{value}.iter()"), element)),
            }
        }
        Type::Array {
            dimensions,
            element,
        } => {
            let flat = ".flatten()".repeat(dimensions.len() - 1);
            total(&format!("{value}.iter(){flat}"), element)
        }
        // `value` is the reference of a closure or a pattern, anything else a place expression.
        _ if value == "value" => "codec::Composite::encoded_len(value)".to_owned(),
        _ => format!("codec::Composite::encoded_len(&{value})"),
    }
}

fn times(size: usize, count: &str) -> String {
    if size == 1 {
        count.to_owned()
    } else {
        format!("{size} * {count}")
    }
}

/// An expression for the size of all elements, given an iterator over them.
fn total(elements: &str, element: &Type) -> String {
    format!("{elements}.map({}).sum::<usize>()", measure(element))
}

/// A function for the size of a value: a path or a closure.
fn measure(ty: &Type) -> String {
    match ty {
        Type::Composite { .. } => "codec::Composite::encoded_len".to_owned(),
        _ => format!("|value| {}", length(ty, "value")),
    }
}

fn write(out: &mut Writer, body: &Body<'_>) {
    let nothing = body.fields.is_empty() && !body.message;
    let output = if nothing { "_" } else { "output" };
    out.push(format!(
        "fn write(&self, {output}: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {{"
    ));
    match body.presence {
        Some(presence) if body.has_fast_path() => {
            full(out, body, presence);
            out.push("self.write_some(output);");
        }
        _ => members(out, body),
    }
    out.push("Ok(())\n}");
}

/// Writes `fn write_some` of a struct with a fast path: the part of `write` for absent members,
/// separate to keep the fast path small.
pub(super) fn some(out: &mut Writer, body: &Body<'_>) {
    out.push("#[inline(never)]");
    out.push("fn write_some(&self, output: &mut codec::Writer<'_>) {");
    members(out, body);
    out.push("}");
}

fn members(out: &mut Writer, body: &Body<'_>) {
    let mut before = Vec::new();
    if body.message {
        before.push((CODE.0.to_owned(), &CODE.1));
    }
    let vector;
    if let Some(presence) = body.presence {
        let ty = unsigned_type(presence);
        let bits = body
            .fields
            .iter()
            .filter(|field| optional(field))
            .enumerate()
            .map(|(bit, field)| match bit {
                0 => format!("{ty}::from(self.{}.is_some())", field.ident),
                _ => format!("{ty}::from(self.{}.is_some()) << {bit}", field.ident),
            });
        let mut bits: Vec<_> = bits.collect();
        bits.iter_mut()
            .take(1)
            .for_each(|first| first.insert_str(0, "let present = "));
        bits.iter_mut()
            .last()
            .into_iter()
            .for_each(|last| last.push(';'));
        out.terms(&bits, "| ");
        vector = Type::Number(Number::Unsigned(presence));
        before.push(("present".to_owned(), &vector));
    }
    let mut rest = body.fields;
    loop {
        let run = rest
            .iter()
            .take_while(|f| !optional(f) && f.ty.size().is_some())
            .count();
        let values = rest[..run]
            .iter()
            .map(|field| (format!("self.{}", field.ident), &field.ty));
        put_run(out, before.drain(..).chain(values));
        let Some((field, after)) = rest[run..].split_first() else {
            return;
        };
        member(out, field);
        rest = after;
    }
}

/// The fast path: all optional members are present, and the size is fixed.
fn full(out: &mut Writer, body: &Body<'_>, presence: Unsigned) {
    let Body { fields, .. } = body;
    let taken: Vec<_> = fields.iter().map(|field| field.ident.as_str()).collect();
    let pattern = |field: &Field<'_>| {
        let (binding, ident) = (binding(field, &taken), &field.ident);
        match optional(field) {
            true => format!("{ident}: Some({binding})"),
            false if binding == *ident => binding,
            false => format!("{ident}: {binding}"),
        }
    };
    let patterns: Vec<_> = fields.iter().map(pattern).collect();
    out.list("if let Self {", &patterns, "} = self {");
    let all = all_bits(fields);
    let code = body.message.then(|| (CODE.0.to_owned(), &CODE.1));
    let vector = Type::Number(Number::Unsigned(presence));
    let present = (format!("{all:#x}_{}", unsigned_type(presence)), &vector);
    let values = fields
        .iter()
        .map(|field| (format!("*{}", binding(field, &taken)), &field.ty));
    put_run(out, code.into_iter().chain([present]).chain(values));
    out.push("return Ok(());\n}");
}

/// The name of a field's value that does not collide with `run` and `output`.
fn binding(field: &Field<'_>, taken: &[&str]) -> String {
    if matches!(field.ident.as_str(), "run" | "output") {
        local(&field.ident, taken)
    } else {
        field.ident.clone()
    }
}

/// The presence vector with all defined bits set.
pub(super) fn all_bits(fields: &[Field<'_>]) -> u64 {
    fields
        .iter()
        .filter(|field| optional(field))
        .fold(0, |bits, _| bits << 1 | 1)
}

/// Writes several values of fixed size as one block of octets.
fn put_run<'t>(out: &mut Writer, values: impl IntoIterator<Item = (String, &'t Type)>) {
    let values: Vec<_> = values.into_iter().collect();
    match &values[..] {
        [] => return,
        [(value, _)] => return out.push(format!("output.fixed({value});")),
        _ => {}
    }
    let size: usize = values.iter().filter_map(|(_, ty)| ty.size()).sum();
    out.push(format!("let run = output.run::<{size}>();"));
    let mut at = 0;
    for (value, ty) in values {
        out.push(format!("codec::Fixed::put({value}, run, {at});"));
        at += ty.size().unwrap_or(0);
    }
}

fn member(out: &mut Writer, field: &Field<'_>) {
    let ident = &field.ident;
    let name = &field.item.name;
    match (optional(field), field.ty.size()) {
        (true, Some(_)) => out.push(format!("output.optional(self.{ident});")),
        (false, Some(_)) => out.push(format!("output.fixed(self.{ident});")),
        (true, None) => {
            out.push(format!("if let Some(value) = &self.{ident} {{"));
            named(out, name, &value(&field.ty, "value"));
            out.push("}");
        }
        (false, None) => named(out, name, &value(&field.ty, &format!("&self.{ident}"))),
    }
}

fn named(out: &mut Writer, name: &str, write: &str) {
    out.push(format!("output.member({name:?}, |output| {write})?;"));
}

/// An expression that writes the referenced value, of type `Result`.
pub(super) fn value(ty: &Type, place: &str) -> String {
    let limits = |count: &Count| format!("{}, {}", count.min, count.max);
    let counted = |call: &str, count: &Count| {
        let ty = unsigned_type(count.unsigned);
        format!(
            "output.{call}::<{ty}{}>({place}, {})",
            generics(call),
            limits(count)
        )
    };
    match ty {
        Type::FixedText(length) => format!("output.fixed_text({place}, {length})"),
        Type::Text(count) => counted("text", count),
        Type::Blob(count) => counted("blob", count),
        Type::Formatted { count, .. } => counted("formatted", count),
        Type::Composite { .. } => format!("codec::Composite::write({place}, output)"),
        Type::List { count, element } => {
            let unsigned = unsigned_type(count.unsigned);
            let limits = limits(count);
            let inner = value(element, "value");
            format!("output.list::<{unsigned}, _>({place}, {limits}, |value, output| {inner})")
        }
        Type::Array {
            dimensions,
            element,
        } if ty.size().is_none() => array(dimensions, element, place),
        _ => {
            let place = match place.strip_prefix('&') {
                Some(place) => place.to_owned(),
                None => format!("*{place}"),
            };
            format!("{{ output.fixed({place}); Ok(()) }}")
        }
    }
}

fn generics(call: &str) -> &'static str {
    if call == "formatted" { ", _" } else { "" }
}

/// The first dimension is the innermost loop.
fn array(dimensions: &[u32], element: &Type, place: &str) -> String {
    let indices: String = (0..dimensions.len()).map(|i| format!("[i{i}]")).collect();
    let place = place.trim_start_matches('&');
    let mut body = format!("{}?;", value(element, &format!("&{place}{indices}")));
    for (i, size) in dimensions.iter().enumerate() {
        body = format!("for i{i} in 0..{size} {{ {body} }}");
    }
    format!("{{ {body} Ok(()) }}")
}
