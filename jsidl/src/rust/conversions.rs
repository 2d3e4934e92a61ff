//! Generates conversions from one layout of a message to the next newer one, where nothing is lost and
//! nothing is missing.

use std::collections::HashMap;

use super::plan::Plan;
use super::types::{Definition, Field, Kind, Type};
use super::writer::Writer;
use crate::model::Number;

/// A member of a message, for comparison with that of another layout.
#[derive(Debug)]
pub(super) struct Member {
    ident: String,
    optional: bool,
    /// Its type, with paths from the root of the set.
    ty: String,
    /// The number in a newtype whose content is public.
    number: Option<Number>,
}

/// The members of a message whose nested types are in a module with this path.
pub(super) fn members(
    fields: &[Field<'_>],
    definitions: &[Definition<'_>],
    module: &str,
) -> Vec<Member> {
    let path = |Definition { ident, kind }: &Definition<'_>| match kind {
        Kind::Reused(path) => (ident.clone(), path.clone()),
        _ => (ident.clone(), format!("{module}::{ident}")),
    };
    let paths: HashMap<_, _> = definitions.iter().map(path).collect();
    let member = |field: &Field<'_>| Member {
        ident: field.ident.clone(),
        optional: field.item.optional,
        ty: field
            .ty
            .named(&|ident| paths.get(ident).cloned().unwrap_or_default()),
        number: match &field.ty {
            Type::Newtype {
                number,
                scale: None,
                ..
            } => Some(*number),
            _ => None,
        },
    };
    fields.iter().map(member).collect()
}

/// Writes the conversions between the layouts of messages. `members` are those of each plan.
pub(super) fn implement(out: &mut Writer, plans: &[Plan<'_>], members: &[Vec<Member>]) {
    for (pair, members) in plans.windows(2).zip(members.windows(2)) {
        let ([newer, older], [to, from]) = (pair, members) else {
            continue;
        };
        if !newer.is_layout_of(older.message) || !is_of_one_service(newer, older) {
            continue;
        }
        if let Some(values) = values(to, from) {
            write(out, newer, older, &values);
        }
    }
}

fn is_of_one_service(one: &Plan<'_>, other: &Plan<'_>) -> bool {
    let mut services = one.services.iter();
    services.any(|id| other.services.iter().any(|it| it.urn == id.urn))
}

/// The values of the members; `None` if one is missing, or would be lost.
fn values(to: &[Member], from: &[Member]) -> Option<Vec<String>> {
    let is_kept = |old: &Member| to.iter().any(|new| new.ident == old.ident);
    if !from.iter().all(is_kept) {
        return None;
    }
    let value = |new: &Member| {
        let ident = &new.ident;
        let old = from.iter().find(|old| old.ident == *ident);
        let value = match old {
            None if new.optional => "None".to_owned(),
            None => return None,
            Some(old) => converted(new, old)?,
        };
        Some(format!("{ident}: {value}"))
    };
    to.iter().map(value).collect()
}

/// The old value of a member as the new one.
fn converted(new: &Member, old: &Member) -> Option<String> {
    let ident = &new.ident;
    let is_same = new.ty == old.ty;
    let is_newtype = new.number.is_some() && new.number == old.number;
    if !is_same && !is_newtype {
        return None;
    }
    let ty = &new.ty;
    match (new.optional, old.optional, is_same) {
        (true, true, true) | (false, false, true) => Some(format!("old.{ident}")),
        (true, false, true) => Some(format!("Some(old.{ident})")),
        (true, true, false) => Some(format!("old.{ident}.map(|it| {ty}(it.0))")),
        (false, false, false) => Some(format!("{ty}(old.{ident}.0)")),
        (true, false, false) => Some(format!("Some({ty}(old.{ident}.0))")),
        (false, true, _) => None,
    }
}

fn write(out: &mut Writer, newer: &Plan<'_>, older: &Plan<'_>, values: &[String]) {
    let (new, old) = (newer.path(), older.path());
    let unused = if values.iter().any(|it| it.contains("old.")) {
        ""
    } else {
        "_"
    };
    out.gap();
    out.allow("unused_qualifications");
    out.push(format!("impl From<{old}> for {new} {{"));
    out.push(format!("fn from({unused}old: {old}) -> Self {{"));
    out.list("Self {", values, "}");
    out.push("}\n}");
}
