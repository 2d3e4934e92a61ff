//! Writes the struct of a message.

use super::quoted;
use crate::model::{Count, Number, Rounding, Signed, Unsigned};
use crate::typed::lines::Lines;
use crate::typed::types::{Definition, Field, Kind, Type};
use crate::typed::{Content, Plan, notes};

/// Writes a message with its nested types.
pub(super) fn message(out: &mut Lines, plan: &Plan<'_>) {
    let message = plan.message;
    let (_, ident) = plan.definition();
    types(out, ident, &plan.types);
    comment(out, &notes::message(plan));
    out.open(format!("struct {ident} {{"));
    out.line(format!(
        "static constexpr std::uint16_t kCode = 0x{:04X};",
        message.code
    ));
    out.line(format!(
        "static constexpr const char* kName = {};",
        quoted(&message.name)
    ));
    out.line(format!(
        "static constexpr bool kIsCommand = {};",
        message.is_command
    ));
    let services = plan.services.iter().map(|id| quoted(&id.to_string()));
    let services: Vec<_> = services.collect();
    out.line(format!(
        "static constexpr std::array<const char*, {}> kServices{{{}}};",
        services.len(),
        services.join(", ")
    ));
    if !plan.types.is_empty() {
        out.line("");
    }
    for Definition { ident: nested, .. } in &plan.types {
        out.line(format!("using {nested} = {ident}_types::{nested};"));
    }
    let fields = plan.content.fields();
    members(out, fields);
    out.line("");
    match &plan.content {
        Content::Members(fields, presence) => visit(out, &group_calls(fields, *presence)),
        Content::Whole(field) => {
            let call = format!("visitor.whole(self.{}{})", field.ident, layout(&field.ty));
            visit(out, &[call]);
        }
        Content::Sections(fields) => {
            let calls = fields.iter().map(|field| {
                let name = quoted(field.name);
                format!(
                    "visitor.section({name}, self.{}{})",
                    field.ident,
                    layout(&field.ty)
                )
            });
            visit(out, &calls.collect::<Vec<_>>());
        }
    }
    out.close("};");
}

/// Writes the nested types of a message. They are in a namespace, because in a class they would not
/// be complete before its end.
fn types(out: &mut Lines, outer: &str, definitions: &[Definition<'_>]) {
    if definitions.is_empty() {
        return;
    }
    out.line(format!("namespace {outer}_types {{"));
    for definition in definitions {
        out.line("");
        define(out, definition);
    }
    out.line("");
    out.line(format!("}} // namespace {outer}_types"));
    out.line("");
}

/// The data members, and the accessors of scaled ones in their units.
fn members(out: &mut Lines, fields: &[Field<'_>]) {
    let mut taken: Vec<String> = Vec::new();
    for (field, notes) in fields.iter().zip(notes::members(fields)) {
        out.line("");
        comment(out, &notes);
        let ty = type_of(&field.ty);
        let ty = if field.item.optional {
            format!("std::optional<{ty}>")
        } else {
            ty
        };
        out.line(format!("{ty} {}{{}};", field.ident));
        taken.push(field.ident.clone());
        taken.extend(field.in_units.clone());
    }
    for field in fields {
        let (Some(get), Type::Scaled { ident }) = (&field.in_units, &field.ty) else {
            continue;
        };
        let set = setter(get, &mut taken);
        let member = &field.ident;
        let returns = if field.item.optional {
            "std::optional<double>"
        } else {
            "double"
        };
        out.line("");
        comment(out, &[notes::accessor(field)]);
        out.line(format!(
            "{returns} {get}() const {{ return codec::in_units(this->{member}); }}"
        ));
        out.line(format!(
            "codec::Checked {set}(double value) {{ return codec::assign(this->{member}, {ident}::of(value)); }}"
        ));
    }
}

/// The name of the setter beside a getter.
fn setter(get: &str, taken: &mut Vec<String>) -> String {
    let mut set = format!("set_{get}");
    while taken.contains(&set) {
        set.push('_');
    }
    taken.push(set.clone());
    set
}

fn group_calls(fields: &[Field<'_>], presence: Option<Unsigned>) -> Vec<String> {
    let optional = fields.iter().filter(|field| field.item.optional);
    let optional: Vec<_> = optional
        .map(|field| format!(", self.{}", field.ident))
        .collect();
    let presence = presence.map(|width| {
        let width = unsigned(width);
        format!("visitor.presence({width}{{}}{})", optional.concat())
    });
    let members = fields.iter().map(|field| {
        let name = quoted(field.name);
        format!("visitor({name}, self.{}{})", field.ident, layout(&field.ty))
    });
    presence.into_iter().chain(members).collect()
}

/// The function that passes all members to a visitor.
fn visit(out: &mut Lines, calls: &[String]) {
    out.line("template <class Visitor, class Self>");
    let Some((first, others)) = calls.split_first() else {
        return out.line("static bool visit(Visitor&, Self&) { return true; }");
    };
    let is_used = calls.iter().any(|call| call.contains("self."));
    let parameter = if is_used { " self" } else { "" };
    out.open(format!(
        "static bool visit(Visitor& visitor, Self&{parameter}) {{"
    ));
    if others.is_empty() {
        out.line(format!("return {first};"));
    } else {
        out.open(format!("return {first}"));
        for (place, call) in others.iter().enumerate() {
            let end = if place + 1 == others.len() { ";" } else { "" };
            out.line(format!("&& {call}{end}"));
        }
        out.end();
    }
    out.close("}");
}

fn define(out: &mut Lines, Definition { ident, kind }: &Definition<'_>) {
    comment(out, &notes::definition(kind));
    match kind {
        Kind::Group {
            presence, fields, ..
        } => {
            out.open(format!("struct {ident} {{"));
            members(out, fields);
            out.line("");
            visit(out, &group_calls(fields, *presence));
            out.close("};");
        }
        Kind::Variant {
            tag, alternatives, ..
        } if alternatives.is_empty() => {
            out.open(format!("struct {ident} {{"));
            visit(out, &[format!("visitor.nothing({}{{}})", unsigned(*tag))]);
            out.close("};");
        }
        Kind::Variant {
            tag, alternatives, ..
        } => {
            let kinds = alternatives.iter().map(|it| (it.ident.as_str(), &it.ty));
            let calls = alternatives.iter().map(|it| {
                let layout = layout_tag(&it.ty);
                format!("codec::Alternative<{layout}>{{{}}}", quoted(it.name))
            });
            let calls: Vec<_> = calls.collect();
            let tag = unsigned(*tag);
            let call = format!(
                "visitor.variant({tag}{{}}, self.chosen, {})",
                calls.join(", ")
            );
            choice(out, ident, &kinds.collect::<Vec<_>>(), &call);
        }
        Kind::Measure { choices, .. } => {
            let kinds = choices.iter().map(|it| (it.ident.as_str(), &it.ty));
            let calls = choices.iter().map(|it| {
                let units = quoted(&it.choice.scalar.units);
                format!("codec::Choice{{{}, {units}}}", it.choice.index)
            });
            let calls: Vec<_> = calls.collect();
            let call = format!("visitor.measure(self.chosen, {})", calls.join(", "));
            choice(out, ident, &kinds.collect::<Vec<_>>(), &call);
        }
        Kind::Scaled {
            name,
            number,
            scale,
            units,
        } => {
            let rounding = match scale.rounding {
                Rounding::Round => "nearest",
                Rounding::Floor => "down",
                Rounding::Ceiling => "up",
            };
            let number = self::number(*number);
            out.open(format!(
                "struct {ident} : codec::Scaled<{ident}, {number}> {{"
            ));
            out.line(format!(
                "static constexpr codec::Range kRange{{{}, {:?}, {:?}, {}, codec::Rounding::{rounding}}};",
                quoted(name),
                scale.lower,
                scale.upper,
                quoted(units)
            ));
            out.close("};");
        }
        Kind::Named { number, values, .. } => {
            out.open(format!("enum class {ident} : {} {{", self::number(*number)));
            for (place, (name, value)) in values.iter().enumerate() {
                comment(out, &notes::value(value));
                let end = if place + 1 == values.len() { "" } else { "," };
                out.line(format!("{name} = {}{end}", integer(value.index, *number)));
            }
            out.close("};");
        }
        Kind::Bits { bits, parts, .. } => {
            let base = unsigned(bits.base);
            out.open(format!("struct {ident} : codec::Bits<{ident}, {base}> {{"));
            let table = parts.iter().map(|part| {
                let (name, (lower, upper)) = (quoted(&part.field.name), part.limits);
                let (from, to) = (part.field.from, part.field.to);
                format!("{{{name}, {from}, {to}, {lower}u, {upper}u}}")
            });
            let table: Vec<_> = table.collect();
            out.line(format!(
                "static constexpr std::array<codec::Part, {}> kParts{{{{{}}}}};",
                parts.len(),
                table.join(", ")
            ));
            let mut taken: Vec<_> = parts.iter().map(|part| part.ident.clone()).collect();
            for (place, part) in parts.iter().enumerate() {
                let (get, set) = (&part.ident, setter(&part.ident, &mut taken));
                let width = unsigned(part.width);
                let ty = part.values.as_deref().unwrap_or(width);
                out.line("");
                comment(out, &notes::part(part.field, part.limits));
                out.line(format!(
                    "{ty} {get}() const {{ return get_bits<{ty}>(kParts[{place}]); }}"
                ));
                out.line(format!(
                    "codec::Checked {set}({ty} value) \
                     {{ return set_bits(kParts[{place}], static_cast<std::uint64_t>(value)); }}"
                ));
            }
            out.close("};");
        }
    }
}

/// A struct that holds one of several types; the enumerators are their places in the variant.
fn choice(out: &mut Lines, ident: &str, kinds: &[(&str, &Type)], call: &str) {
    let names: Vec<_> = kinds.iter().map(|(name, _)| *name).collect();
    let types: Vec<_> = kinds.iter().map(|(_, ty)| type_of(ty)).collect();
    out.open(format!("struct {ident} {{"));
    out.line(format!("enum : std::size_t {{ {} }};", names.join(", ")));
    out.line(format!("std::variant<{}> chosen{{}};", types.join(", ")));
    out.line("");
    visit(out, &[call.to_owned()]);
    out.close("};");
}

fn type_of(ty: &Type) -> String {
    match ty {
        Type::Number(number) => self::number(*number).to_owned(),
        Type::Named { ident, .. } | Type::Scaled { ident } | Type::Defined { ident } => {
            ident.clone()
        }
        Type::FixedText(_) | Type::Text(_) => "std::string".to_owned(),
        Type::Blob(_) => "codec::Octets".to_owned(),
        Type::Formatted { formats, .. } => format!("codec::Formatted<{formats}>"),
        Type::List { element, .. } => format!("std::vector<{}>", type_of(element)),
        Type::Array {
            dimensions,
            element,
        } => {
            let sizes = dimensions.iter().map(|size| format!(", {size}"));
            format!(
                "codec::Array<{}{}>",
                type_of(element),
                sizes.collect::<String>()
            )
        }
    }
}

/// The layout as a further argument of a call; nothing if the C++ type says it all.
fn layout(ty: &Type) -> String {
    match layout_tag(ty).as_str() {
        "codec::Value" => String::new(),
        tag => format!(", {tag}{{}}"),
    }
}

fn layout_tag(ty: &Type) -> String {
    let limits = |count: &Count| {
        let Count { unsigned, min, max } = *count;
        format!("{}, {min}u, {max}u", self::unsigned(unsigned))
    };
    match ty {
        Type::FixedText(length) => format!("codec::Padded<{length}>"),
        Type::Text(count) | Type::Blob(count) | Type::Formatted { count, .. } => {
            format!("codec::Counted<{}>", limits(count))
        }
        Type::List { count, element } => {
            format!("codec::List<{}, {}>", limits(count), layout_tag(element))
        }
        Type::Array { element, .. } => format!("codec::Each<{}>", layout_tag(element)),
        _ => "codec::Value".to_owned(),
    }
}

const fn unsigned(number: Unsigned) -> &'static str {
    self::number(Number::Unsigned(number))
}

const fn number(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U8) => "std::uint8_t",
        Number::Unsigned(Unsigned::U16) => "std::uint16_t",
        Number::Unsigned(Unsigned::U32) => "std::uint32_t",
        Number::Unsigned(Unsigned::U64) => "std::uint64_t",
        Number::Signed(Signed::I8) => "std::int8_t",
        Number::Signed(Signed::I16) => "std::int16_t",
        Number::Signed(Signed::I32) => "std::int32_t",
        Number::Signed(Signed::I64) => "std::int64_t",
        Number::F32 => "float",
        Number::F64 => "double",
    }
}

/// A literal of an integer.
fn integer(value: i128, number: Number) -> String {
    match number {
        Number::Unsigned(_) => format!("{value}u"),
        // A literal has no sign, and this one without it is too large.
        _ if value == i64::MIN.into() => format!("{} - 1", i64::MIN + 1),
        _ => value.to_string(),
    }
}

fn comment(out: &mut Lines, paragraphs: &[String]) {
    for line in notes::wrapped(paragraphs, out.width().saturating_sub(4)) {
        // A backslash at the end of a line would continue the comment.
        let end = if line.ends_with(['\\', '/']) {
            " ."
        } else {
            ""
        };
        out.line(format!("/// {line}{end}").trim_end());
    }
}
