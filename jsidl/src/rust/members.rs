//! Generates what the members of a struct determine: its JSON view, and random values of it.

use super::random;
use super::types::Field;
use super::writer::Writer;

/// Writes both for a struct that is shown as an object.
pub(super) fn group(out: &mut Writer, ident: &str, fields: &[Field<'_>]) {
    let member = |field: &Field<'_>| {
        let (member, name) = (&field.ident, &field.item.name);
        format!("{member}: {name:?}{}", made(field))
    };
    let members: Vec<_> = fields.iter().map(member).collect();
    out.gap();
    out.list(&format!("codec::members!({ident} {{"), &members, "});");
}

/// Writes both for a struct that is shown as its only member.
pub(super) fn transparent(out: &mut Writer, ident: &str, field: &Field<'_>) {
    out.gap();
    out.push(format!(
        "codec::members!({ident} is {}{});",
        field.ident,
        made(field)
    ));
}

fn made(field: &Field<'_>) -> String {
    random::maker(field).map_or_else(String::new, |maker| format!(" = {maker}"))
}
