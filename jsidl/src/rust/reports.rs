//! Generates the trait of reports: the time of the sample, and the report without values.

use super::layout::{Layout, unsigned_bits};
use super::newtypes::is_time_stamp;
use super::plan::Plan;
use super::queries::report;
use super::types::{Field, Kind, Type};
use super::writer::Writer;
use crate::model::Shape;

/// Implements `Report` if the message is the report of a query in the set.
pub(super) fn implement(out: &mut Writer, plan: &Plan<'_>, plans: &[Plan<'_>]) {
    let of_this_name = |query: &&Plan<'_>| query.report == Some(&plan.message.name);
    let mut queries = plans.iter().filter(of_this_name);
    if !queries.any(|query| report(query, plans).is_some_and(|it| std::ptr::eq(it, plan))) {
        return;
    }
    let layout = Layout::of(plan.message);
    let times = layout
        .as_ref()
        .map_or_else(Vec::new, |it| times(it, "self", &it.fields));
    let needs_values = layout
        .as_ref()
        .is_none_or(|it| requires_any(it, &it.fields));
    out.gap();
    if times.is_empty() && needs_values {
        out.push(format!("impl codec::Report for {} {{}}", plan.ident));
        return;
    }
    out.push(format!("impl codec::Report for {} {{", plan.ident));
    if !times.is_empty() {
        out.push("fn stamp(&mut self, since_1970: ::core::time::Duration) {");
        for line in times {
            out.push(line);
        }
        out.push("}");
    }
    if !needs_values {
        out.gap();
        let is_unit = layout.is_some_and(|it| it.fields.is_empty());
        let report = if is_unit { "Self" } else { "Self::default()" };
        out.push(format!(
            "fn without_values() -> Option<Self> {{\nSome({report})\n}}"
        ));
    }
    out.push("}");
}

/// Whether one of the fields has a value in every report. A list has none: it may be empty.
fn requires_any(layout: &Layout<'_>, fields: &[Field<'_>]) -> bool {
    fields.iter().any(|field| match &field.ty {
        _ if field.item.optional => false,
        Type::List { count, .. } => count.min > 0,
        ty => match layout.definition(ty) {
            Some(Kind::Struct { fields, .. }) => requires_any(layout, fields),
            _ => true,
        },
    })
}

/// Statements that set the times that are unset: in a record, in the records that it always
/// contains, and in the elements of lists.
fn times(layout: &Layout<'_>, path: &str, fields: &[Field<'_>]) -> Vec<String> {
    let mut lines = Vec::new();
    let integer = |name: &str| {
        let field = fields.iter().find(|field| field.item.name == name)?;
        let path = format!("{path}.{}", field.ident);
        (unsigned_bits(field.item) == Some(32)).then_some((field.item.optional, path))
    };
    if let (Some((optional, seconds)), Some((both, nanoseconds))) =
        (integer("TimeSeconds"), integer("TimeNanoSeconds"))
        && optional == both
    {
        lines.push(set_seconds(optional, &seconds, &nanoseconds));
    }
    for field in fields {
        let path = format!("{path}.{}", field.ident);
        match &field.item.shape {
            Shape::Bits(bits) if field.item.name == "TimeStamp" && is_time_stamp(bits) => {
                lines.push(set_stamp(field.item.optional, &path));
            }
            _ if !field.item.optional => lines.extend(times_inside(layout, &path, &field.ty)),
            _ => {}
        }
    }
    lines
}

fn times_inside(layout: &Layout<'_>, path: &str, ty: &Type) -> Vec<String> {
    if let Type::List { element, .. } = ty {
        let mut lines = times_inside(layout, "item", element);
        if !lines.is_empty() {
            lines.insert(0, format!("for item in &mut {path} {{"));
            lines.push("}".to_owned());
        }
        return lines;
    }
    match layout.definition(ty) {
        Some(Kind::Struct { fields, .. }) => times(layout, path, fields),
        _ => Vec::new(),
    }
}

fn set_seconds(optional: bool, seconds: &str, nanoseconds: &str) -> String {
    if optional {
        return format!(
            "if {seconds}.is_none() && {nanoseconds}.is_none() {{\n\
             {seconds} = u32::try_from(since_1970.as_secs()).ok();\n\
             {nanoseconds} = Some(since_1970.subsec_nanos());\n}}"
        );
    }
    format!(
        "if {seconds} == 0 && {nanoseconds} == 0 {{\n\
         {seconds} = u32::try_from(since_1970.as_secs()).unwrap_or(0);\n\
         {nanoseconds} = since_1970.subsec_nanos();\n}}"
    )
}

/// 0 is no time stamp: days count from 1.
fn set_stamp(optional: bool, path: &str) -> String {
    let (is_unset, stamp) = match optional {
        true => (".is_none()", ".get_or_insert_default()"),
        false => (".0 == 0", ""),
    };
    format!("if {path}{is_unset} {{\n{path}{stamp}.0 = codec::time_stamp(since_1970);\n}}")
}
