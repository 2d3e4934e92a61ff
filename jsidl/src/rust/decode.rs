//! How octets become values: `read`.

use super::encode::all_bits;
use super::ident::local;
use super::structs::optional;
use super::types::{Field, Type, unsigned_type};
use super::writer::Writer;
use crate::model::{Count, Unsigned};

/// Writes `fn read` of a struct.
pub(super) fn group(out: &mut Writer, fields: &[Field<'_>], presence: Option<Unsigned>) {
    if fields.is_empty() {
        out.push("fn read(_: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {");
        out.push("Ok(Self)\n}");
        return;
    }
    let taken: Vec<_> = fields.iter().map(|field| field.ident.as_str()).collect();
    let names = Locals {
        input: local("input", &taken),
        present: local("present", &taken),
        run: local("run", &taken),
    };
    let input = &names.input;
    out.push(format!(
        "fn read({input}: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {{"
    ));
    if let Some(unsigned) = presence {
        let (all, ty) = (all_bits(fields), unsigned_type(unsigned));
        let present = &names.present;
        out.push(format!(
            "let {present} = {input}.presence::<{ty}>({all:#x})?;"
        ));
        full(out, fields, &names);
    }
    members(out, fields, &names);
    let idents: Vec<_> = fields.iter().map(|field| field.ident.as_str()).collect();
    out.push("Ok(Self {");
    out.push(idents.join(",\n") + ",");
    out.push("})\n}");
}

/// Local variables, named unlike any field.
struct Locals {
    input: String,
    present: String,
    run: String,
}

/// The fast path: all optional members are there, and everything has one size.
fn full(out: &mut Writer, fields: &[Field<'_>], names: &Locals) {
    if fields.iter().any(|field| field.ty.size().is_none()) {
        return;
    }
    let run = &names.run;
    out.push(format!(
        "if {} == {:#x} {{",
        names.present,
        all_bits(fields)
    ));
    take_run(out, fields, names);
    out.push("return Ok(Self {");
    let mut at = 0;
    for field in fields {
        let value = format!("codec::Fixed::get({run}, {at})");
        let value = if optional(field) {
            format!("Some({value})")
        } else {
            value
        };
        out.push(format!("{}: {value},", field.ident));
        at += field.ty.size().unwrap_or(0);
    }
    out.push("});\n}");
}

/// Takes the octets of several values of fixed size under one check.
fn take_run(out: &mut Writer, fields: &[Field<'_>], names: &Locals) {
    let sizes: Vec<_> = fields
        .iter()
        .flat_map(|f| f.ty.named_sizes(&f.item.name))
        .collect();
    let size: usize = sizes.iter().map(|(_, size)| size).sum();
    out.push(format!(
        "let {} = {}.run::<{size}>(&[",
        names.run, names.input
    ));
    for (name, size) in sizes {
        out.push(format!("({name:?}, {size}),"));
    }
    out.push("])?;");
}

fn members(out: &mut Writer, fields: &[Field<'_>], names: &Locals) {
    let mut bit = 0;
    let mut rest = fields;
    while let Some((field, after)) = rest.split_first() {
        let run = rest
            .iter()
            .take_while(|f| !optional(f) && f.ty.size().is_some())
            .count();
        if run > 1 {
            take_run(out, &rest[..run], names);
            let mut at = 0;
            for field in &rest[..run] {
                let size = field.ty.size().unwrap_or(0);
                out.push(format!(
                    "let {} = codec::Fixed::get({}, {at});",
                    field.ident, names.run
                ));
                at += size;
            }
            rest = &rest[run..];
            continue;
        }
        member(out, field, bit, names);
        bit += u32::from(optional(field));
        rest = after;
    }
}

fn member(out: &mut Writer, field: &Field<'_>, bit: u32, names: &Locals) {
    let Locals { input, present, .. } = names;
    let (ident, name) = (&field.ident, &field.item.name);
    let read = reader(&field.ty);
    if optional(field) {
        let mask = 1_u64 << bit;
        out.push(format!(
            "let {ident} = {input}.optional({present} & {mask:#x} != 0, {name:?}, {read})?;"
        ));
    } else {
        out.push(format!("let {ident} = {input}.member({name:?}, {read})?;"));
    }
}

/// A function that reads a value: a path or a closure.
pub(super) fn reader(ty: &Type) -> String {
    match ty {
        _ if ty.size().is_some() => "codec::Reader::fixed".to_owned(),
        Type::Composite { .. } => "codec::Composite::read".to_owned(),
        _ => format!("|input| {}", value(ty)),
    }
}

/// An expression that reads a value from `input`, of type `Result`.
fn value(ty: &Type) -> String {
    let counted = |call: &str, generics: &str, count: &Count| {
        let unsigned = unsigned_type(count.unsigned);
        format!(
            "input.{call}::<{unsigned}{generics}>({}, {})",
            count.min, count.max
        )
    };
    match ty {
        Type::FixedText(length) => format!("input.fixed_text({length})"),
        Type::Text(count) => counted("text", "", count),
        Type::Blob(count) => counted("blob", "", count),
        Type::Formatted { count, .. } => counted("formatted", ", _", count),
        Type::List { count, element } => {
            let unsigned = unsigned_type(count.unsigned);
            let (min, max, least) = (count.min, count.max, element.least());
            let element = reader(element);
            format!("input.list::<{unsigned}, _>({min}, {max}, {least}, {element})")
        }
        Type::Array {
            dimensions,
            element,
        } if ty.size().is_none() => array(dimensions, element),
        Type::Composite { .. } => "codec::Composite::read(input)".to_owned(),
        _ => "input.fixed()".to_owned(),
    }
}

/// The first dimension is the innermost loop.
fn array(dimensions: &[u32], element: &Type) -> String {
    let empty = |inner, _: &u32| format!("::std::array::from_fn(|_| {inner})");
    let empty = dimensions
        .iter()
        .fold("Default::default()".to_owned(), empty);
    let indices: String = (0..dimensions.len()).map(|i| format!("[i{i}]")).collect();
    let ty = dimensions
        .iter()
        .rev()
        .fold("_".to_owned(), |inner, size| format!("[{inner}; {size}]"));
    let mut body = format!("array{indices} = {}?;", value(element));
    for (i, size) in dimensions.iter().enumerate() {
        body = format!("for i{i} in 0..{size} {{ {body} }}");
    }
    format!("{{ let mut array: {ty} = {empty}; {body} Ok(array) }}")
}
