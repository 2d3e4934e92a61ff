//! Descriptions of classes, as JSON.

use serde_json::{Value as Json, json};

use super::{everything, plan, report, vectors};
use crate::library::Library;
use crate::model::{Count, Id, Number, Rounding, Service, Shape, Signed, Unsigned};
use crate::presence::PresenceVector;
use crate::typed::names::version;
use crate::typed::types::{Alternative, Definition, Field, Kind, Part, Type};
use crate::typed::{Content, Plan, Set, notes};

/// A set of services.
#[derive(Debug)]
pub struct SetDescription {
    /// The name of its module, for example `core`.
    pub name: String,
    /// The common part of the URNs, such as `urn:jaus:jss:core`.
    pub urn: String,
    /// Older versions first.
    pub classes: Vec<ClassDescription>,
}

/// A class: one layout of a message.
#[derive(Debug)]
pub struct ClassDescription {
    /// The message's name in its definition.
    pub message: String,
    /// The message code.
    pub code: u16,
    /// The versions that declare the layout, with the name of the class in each; the first one
    /// defines it.
    pub places: Vec<(String, String)>,
    /// The name in the set, if no newer version has another layout.
    pub newest: Option<String>,
    /// The declaring services.
    pub services: Vec<Id>,
    /// Members and nested types, for the Python package: names, types, limits and documentation.
    pub layout: Json,
}

/// Describes the classes of the services that `wanted` selects, one set after the other.
pub fn describe(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<SetDescription> {
    let sets = plan(library, wanted);
    let described = sets.iter().map(|set| SetDescription {
        name: set.name.clone(),
        urn: set.urn.to_owned(),
        classes: set.messages.iter().map(|plan| class(plan, set)).collect(),
    });
    described.collect()
}

fn class(plan: &Plan<'_>, set: &Set<'_>) -> ClassDescription {
    let message = plan.message;
    let places = plan.places.iter();
    ClassDescription {
        message: message.name.clone(),
        code: message.code,
        places: places
            .map(|(number, ident)| (version(*number), ident.clone()))
            .collect(),
        newest: plan.newest.clone(),
        services: plan.services.iter().map(|id| (*id).clone()).collect(),
        layout: layout(plan, set),
    }
}

fn layout(plan: &Plan<'_>, set: &Set<'_>) -> Json {
    let content = match &plan.content {
        Content::Members(..) => "members",
        Content::Whole(_) => "whole",
        Content::Sections(_) => "sections",
    };
    let report = report(plan, set).map(|report| {
        let (number, ident) = report.definition();
        json!([version(number), ident])
    });
    let types = plan.types.iter().map(definition);
    json!({
        "doc": text(&notes::message(plan)),
        "isCommand": plan.message.is_command,
        "report": report,
        "content": content,
        "fields": fields(plan.content.fields(), &vectors(plan, set)),
        "types": types.collect::<Vec<_>>(),
    })
}

fn text(paragraphs: &[String]) -> String {
    paragraphs.join("\n\n")
}

fn fields(fields: &[Field<'_>], vectors: &[PresenceVector]) -> Json {
    let described = fields.iter().zip(notes::members(fields));
    let described = described.map(|(field, notes)| {
        json!({
            "key": field.ident,
            "name": field.name,
            "optional": field.item.optional,
            "type": type_of(&field.ty),
            "inUnits": field.in_units,
            "units": units(&field.item.shape),
            "default": everything(vectors, field.name),
            "doc": text(&notes),
        })
    });
    described.collect()
}

fn units(shape: &Shape) -> &str {
    match shape {
        Shape::Scalar(scalar) if scalar.units != "one" => &scalar.units,
        Shape::Array(array) => units(&array.element.shape),
        _ => "",
    }
}

fn definition(Definition { ident, kind }: &Definition<'_>) -> Json {
    let mut described = match kind {
        Kind::Group { fields, .. } => json!({
            "kind": "group",
            "fields": self::fields(fields, &[]),
        }),
        Kind::Variant { alternatives, .. } => json!({
            "kind": "variant",
            "alternatives": fields(alternatives, &[]),
        }),
        Kind::Measure { choices, .. } => json!({
            "kind": "measure",
            "choices": choices.iter().map(choice).collect::<Vec<_>>(),
        }),
        Kind::Scaled {
            name,
            number,
            scale,
            units,
        } => json!({
            "kind": "scaled",
            "name": name,
            "number": number_name(*number),
            "lower": scale.lower,
            "upper": scale.upper,
            "rounding": match scale.rounding {
                Rounding::Round => "round",
                Rounding::Floor => "floor",
                Rounding::Ceiling => "ceiling",
            },
            "units": units,
        }),
        Kind::Named { number, values, .. } => {
            let values = values.iter().map(|(ident, value)| {
                // The values that fit the type have at most eight octets.
                let index = i64::try_from(value.index).map(Json::from);
                let index = index.unwrap_or_else(|_| Json::from(value.index as u64));
                json!([ident, index, text(&notes::value(value))])
            });
            json!({
                "kind": "named",
                "number": number_name(*number),
                "values": values.collect::<Vec<_>>(),
            })
        }
        Kind::Bits { item, bits, parts } => json!({
            "kind": "bits",
            "name": item.name,
            "number": number_name(Number::Unsigned(bits.base)),
            "parts": parts.iter().map(part).collect::<Vec<_>>(),
        }),
    };
    described["ident"] = ident.as_str().into();
    described["doc"] = text(&notes::definition(kind)).into();
    described
}

fn choice(alternative: &Alternative<'_>) -> Json {
    json!({
        "key": alternative.ident,
        "index": alternative.choice.index,
        "units": alternative.choice.scalar.units,
        "type": type_of(&alternative.ty),
    })
}

fn part(part: &Part<'_>) -> Json {
    json!({
        "key": part.ident,
        "name": part.field.name,
        "from": part.field.from,
        "to": part.field.to,
        "lower": part.limits.0,
        "upper": part.limits.1,
        "values": part.values,
        "doc": text(&notes::part(part.field, part.limits)),
    })
}

fn type_of(ty: &Type) -> Json {
    match ty {
        Type::Number(number) => json!({ "kind": "number", "number": number_name(*number) }),
        Type::Named { ident, number } => {
            json!({ "kind": "named", "ident": ident, "number": number_name(*number) })
        }
        Type::Scaled { ident } => json!({ "kind": "scaled", "ident": ident }),
        Type::Defined { ident } => json!({ "kind": "defined", "ident": ident }),
        Type::FixedText(length) => {
            json!({ "kind": "text", "min": 0, "max": length, "isFixed": true })
        }
        Type::Text(count) => {
            let mut described = counted("text", count);
            described["isFixed"] = false.into();
            described
        }
        Type::Blob(count) => counted("blob", count),
        Type::Formatted { formats, count } => {
            let mut described = counted("formatted", count);
            described["formats"] = formats.as_str().into();
            described
        }
        Type::List { count, element } => {
            let mut described = counted("list", count);
            described["element"] = type_of(element);
            described
        }
        Type::Array {
            dimensions,
            element,
        } => json!({ "kind": "array", "dimensions": dimensions, "element": type_of(element) }),
    }
}

fn counted(kind: &str, count: &Count) -> Json {
    json!({ "kind": kind, "min": count.min, "max": count.max })
}

const fn number_name(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U8) => "u8",
        Number::Unsigned(Unsigned::U16) => "u16",
        Number::Unsigned(Unsigned::U32) => "u32",
        Number::Unsigned(Unsigned::U64) => "u64",
        Number::Signed(Signed::I8) => "i8",
        Number::Signed(Signed::I16) => "i16",
        Number::Signed(Signed::I32) => "i32",
        Number::Signed(Signed::I64) => "i64",
        Number::F32 => "f32",
        Number::F64 => "f64",
    }
}
