//! Generates a message: its struct, its codec, and the module of its nested types.

use std::collections::{BTreeMap, HashMap};

use super::conversions::Member;
use super::plan::Plan;
use super::structs::Body;
use super::types::{Definition, Field, Kind, Nested};
use super::writer::Writer;
use super::{choices, conversions, decode, docs, encode, members, newtypes, structs};
use crate::model::{Group, Id, Item, Message, Shape, Unsigned};

/// What was written of a message.
pub(super) struct Written {
    /// Whether there is a module with its nested types.
    pub(super) has_module: bool,
    pub(super) members: Vec<Member>,
}

/// Members of a message's struct.
enum Content<'m> {
    /// The members of the body's group.
    Flat(Vec<Field<'m>>, Option<Unsigned>),
    /// A body that is a list or a variant, as the only member.
    Single(Vec<Field<'m>>),
}

/// Writes a message and the module of its nested types.
pub(super) fn message<'m>(
    out: &mut Writer,
    plan: &Plan<'m>,
    sections: &'m [Item],
    other_layouts: &[String],
    shared: &mut HashMap<String, String>,
) -> Written {
    let mut nested = Nested::new(shared, plan.module_path());
    let content = content(plan.message, sections, &mut nested);
    let definitions = nested.definitions;
    let prefix = format!("{}::", plan.module);
    let ident = &plan.ident;
    let message = plan.message;

    out.gap();
    out.doc([
        format!(
            "`{}` ({:04X}h){}.",
            message.name,
            message.code,
            kind(message)
        )
        .as_str(),
        &match message.is_deprecated {
            true => format!("Deprecated: {REPLACED}."),
            false => String::new(),
        },
        &docs::prose(&message.description),
        &format!("Declared by {}.", services(&plan.services)),
    ]);
    let (fields, presence) = match &content {
        Content::Flat(fields, presence) => (fields, *presence),
        Content::Single(fields) => (fields, None),
    };
    if plan.is_deprecated {
        out.push(format!("#[deprecated = {REPLACED:?}]"));
    }
    structs::declare(out, ident, fields, &prefix, false);
    out.gap();
    out.push(format!("impl codec::Message for {ident} {{"));
    out.push(format!("const CODE: u16 = 0x{:04X};", message.code));
    out.push(format!("const NAME: &'static str = {:?};", message.name));
    if message.is_command {
        out.push("const IS_COMMAND: bool = true;");
    }
    if plan.needs_control {
        out.push("const NEEDS_CONTROL: bool = true;");
    }
    if plan.needs_readiness {
        out.push("const NEEDS_READINESS: bool = true;");
    }
    if !other_layouts.is_empty() {
        out.push(format!(
            "const OTHER_LAYOUTS: &'static [codec::ServiceId] = &[{}];",
            other_layouts.join(", ")
        ));
    }
    codec(
        out,
        ident,
        &Body {
            fields,
            presence,
            message: true,
        },
    );
    match &content {
        Content::Flat(fields, _) => members::group(out, ident, fields),
        Content::Single(fields) => members::transparent(out, ident, &fields[0]),
    }
    let has_module = !definitions.is_empty();
    if has_module {
        module(out, plan, &definitions);
    }
    Written {
        has_module,
        members: conversions::members(fields, &definitions, &plan.module_path()),
    }
}

const REPLACED: &str = "newer components use another message in its place";

fn kind(message: &Message) -> &'static str {
    if message.is_command {
        ", a command"
    } else {
        ""
    }
}

fn services(services: &[&Id]) -> String {
    let mut names: Vec<String> = Vec::new();
    for id in services {
        let name = format!("`{id}`");
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.join(", ")
}

/// The parts of a message that are members of its struct: header, body and footer, if it has more
/// than a body.
pub(super) fn sections(message: &Message) -> Vec<Item> {
    if message.header.is_none() && message.footer.is_none() {
        return Vec::new();
    }
    let named = |(name, section): (&str, &Option<Item>)| {
        section.clone().map(|item| Item {
            name: name.to_owned(),
            ..item
        })
    };
    [
        ("header", &message.header),
        ("body", &message.body),
        ("footer", &message.footer),
    ]
    .into_iter()
    .filter_map(named)
    .collect()
}

fn content<'m>(
    message: &'m Message,
    sections: &'m [Item],
    nested: &mut Nested<'m, '_>,
) -> Content<'m> {
    if !sections.is_empty() {
        return Content::Flat(nested.fields(sections), None);
    }
    let fields = fields(message, nested);
    match message.body.as_ref().map(|body| &body.shape) {
        None => Content::Flat(fields, None),
        Some(Shape::Group(group)) => Content::Flat(fields, group.presence),
        Some(_) => Content::Single(fields),
    }
}

/// The fields of a message's body.
pub(super) fn fields<'m>(message: &'m Message, nested: &mut Nested<'m, '_>) -> Vec<Field<'m>> {
    match &message.body {
        None => Vec::new(),
        Some(Item {
            shape: Shape::Group(group),
            ..
        }) => nested.fields(&group.members),
        Some(body) => nested.fields([body]),
    }
}

/// Completes an `impl` of the codec.
fn codec(out: &mut Writer, ident: &str, body: &Body<'_>) {
    encode::group(out, body);
    out.gap();
    decode::group(out, body);
    out.push("}");
    if body.has_fast_path() {
        out.gap();
        out.push(format!("impl {ident} {{"));
        encode::some(out, body);
        out.gap();
        decode::some(out, body.fields);
        out.push("}");
    }
}

fn module(out: &mut Writer, plan: &Plan<'_>, definitions: &[Definition<'_>]) {
    out.gap();
    out.push(format!("/// The types inside [`{}`].", plan.ident));
    out.push(format!("pub mod {} {{", plan.module));
    let root = "super::super::";
    if definitions
        .iter()
        .any(|definition| !matches!(definition.kind, Kind::Reused(_)))
    {
        out.push("use super::codec;");
    }
    let mut reused: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for definition in definitions {
        if let Kind::Reused(path) = &definition.kind
            && let Some((module, name)) = path.rsplit_once("::")
        {
            let types = reused.entry(module).or_default();
            types.push(super::alias(name, &definition.ident));
        }
    }
    for (module, types) in reused {
        out.import(&format!("{root}{module}"), &types);
    }
    for definition in definitions {
        define(out, definition);
    }
    out.push("}");
}

fn define(out: &mut Writer, Definition { ident, kind }: &Definition<'_>) {
    if !matches!(kind, Kind::Reused(_)) {
        out.gap();
    }
    match kind {
        Kind::Reused(_) => {}
        Kind::Struct {
            item,
            group,
            fields,
        } => structure(out, ident, item, group, fields),
        Kind::Variant {
            item,
            variant,
            alternatives,
        } => {
            choices::variant(out, ident, item, variant, alternatives);
        }
        Kind::Measure { item, choices } => choices::measure(out, ident, item, choices),
        Kind::Scaled {
            name,
            number,
            scale,
            unit,
        } => {
            newtypes::scaled(out, ident, name, *number, *scale, unit);
        }
        Kind::Enumeration {
            name,
            number,
            values,
            set,
        } => {
            newtypes::enumeration(out, ident, name, *number, values, *set);
        }
        Kind::Bits { item, bits, fields } => newtypes::bits(out, ident, item, bits, fields),
    }
}

fn structure(out: &mut Writer, ident: &str, item: &Item, group: &Group, fields: &[Field<'_>]) {
    out.doc([
        format!("`{}`.", item.name).as_str(),
        &docs::interpretation(item),
    ]);
    let fixed = group.presence.is_none()
        && !fields.is_empty()
        && fields.iter().all(|field| field.ty.size().is_some());
    structs::declare(out, ident, fields, "", fixed);
    if fixed {
        structs::fixed(out, ident, fields);
    } else {
        let body = Body {
            fields,
            presence: group.presence,
            message: false,
        };
        out.gap();
        out.push(format!("impl codec::Composite for {ident} {{"));
        out.push(format!("const MIN_LEN: usize = {};", body.least()));
        codec(out, ident, &body);
    }
    members::group(out, ident, fields);
}
