//! Generates the decoder: `read`.

use super::encode::all_bits;
use super::ident::local;
use super::structs::{Body, optional};
use super::types::{Field, Type, unsigned_type};
use super::writer::Writer;
use crate::model::Count;

/// Writes `fn read` of a struct.
pub(super) fn group(out: &mut Writer, body: &Body<'_>) {
    let fields = body.fields;
    let names = Locals::beside(fields);
    let input = match (fields.is_empty(), body.message) {
        (true, false) => "_",
        _ => &names.input,
    };
    if body.inlined() {
        out.push("#[inline]");
    }
    out.push(format!(
        "fn read({input}: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {{"
    ));
    if body.message {
        out.push(format!("{input}.code(Self::CODE)?;"));
    }
    if fields.is_empty() {
        out.push("Ok(Self)\n}");
        return;
    }
    if let Some(unsigned) = body.presence {
        let (all, ty) = (all_bits(fields), unsigned_type(unsigned));
        let present = &names.present;
        out.push(format!(
            "let {present} = {input}.presence::<{ty}>({all:#x})?;"
        ));
        if body.has_fast_path() {
            full(out, fields, &names);
            out.push(format!("Self::read_some({input}, {present})\n}}"));
            return;
        }
    }
    members(out, fields, &names);
    construct(out, fields);
}

/// Writes `fn read_some` of a struct with a fast path: the part of `read` for absent members,
/// separate to keep the fast path small.
pub(super) fn some(out: &mut Writer, fields: &[Field<'_>]) {
    let names = Locals::beside(fields);
    let Locals {
        input,
        present,
        place,
        ..
    } = &names;
    out.push("#[inline(never)]");
    out.push(format!(
        "fn read_some({place}: &mut codec::Reader<'_>, {present}: u64) -> Result<Self, codec::DecodeError> {{"
    ));
    out.push(format!("let mut {input} = {place}.clone();"));
    members(out, fields, &names);
    out.push(format!("*{place} = {input};"));
    construct(out, fields);
}

/// Builds the struct from variables with the names of its fields.
fn construct(out: &mut Writer, fields: &[Field<'_>]) {
    let idents: Vec<_> = fields.iter().map(|field| field.ident.as_str()).collect();
    out.list("Ok(Self {", &idents, "})");
    out.push("}");
}

/// Local variables with names that differ from all fields.
struct Locals {
    input: String,
    place: String,
    present: String,
    run: String,
}

impl Locals {
    fn beside(fields: &[Field<'_>]) -> Self {
        let taken: Vec<_> = fields.iter().map(|field| field.ident.as_str()).collect();
        Self {
            input: local("input", &taken),
            place: local("place", &taken),
            present: local("present", &taken),
            run: local("run", &taken),
        }
    }
}

/// The fast path: all optional members are present, and the size is fixed.
fn full(out: &mut Writer, fields: &[Field<'_>], names: &Locals) {
    let (run, present, all) = (&names.run, &names.present, all_bits(fields));
    out.push(format!("if {present} == {all:#x} {{"));
    take_run(out, fields, names);
    let mut at = 0;
    let member = |field: &Field<'_>| {
        let value = format!("codec::Fixed::get({run}, {at})");
        at += field.ty.size().unwrap_or(0);
        match optional(field) {
            true => format!("{}: Some({value})", field.ident),
            false => format!("{}: {value}", field.ident),
        }
    };
    let members: Vec<_> = fields.iter().map(member).collect();
    out.list("return Ok(Self {", &members, "});");
    out.push("}");
}

/// Reads several values of fixed size with one length check.
fn take_run(out: &mut Writer, fields: &[Field<'_>], names: &Locals) {
    let sizes: Vec<_> = fields
        .iter()
        .flat_map(|f| f.ty.named_sizes(&f.item.name))
        .collect();
    let size: usize = sizes.iter().map(|(_, size)| size).sum();
    let open = format!("let {} = {}.run::<{size}>(&[", names.run, names.input);
    let sizes = sizes
        .iter()
        .map(|(name, size)| format!("({name:?}, {size})"));
    out.list(&open, &sizes.collect::<Vec<_>>(), "])?;");
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
        } if ty.size().is_none() => array(dimensions, element, ty),
        Type::Composite { .. } => "codec::Composite::read(input)".to_owned(),
        _ => "input.fixed()".to_owned(),
    }
}

/// The first dimension is the innermost loop.
fn array(dimensions: &[u32], element: &Type, whole: &Type) -> String {
    let empty = whole.filled("Default::default()");
    let indices: String = (0..dimensions.len()).map(|i| format!("[i{i}]")).collect();
    let ty = whole.array_of("_");
    let mut body = format!("array{indices} = {}?;", value(element));
    for (i, size) in dimensions.iter().enumerate() {
        body = format!("for i{i} in 0..{size} {{ {body} }}");
    }
    let least = whole.least();
    format!("{{ input.require({least})?; let mut array: {ty} = {empty}; {body} Ok(array) }}")
}
