//! Generates the JSON view of structs.

use super::types::Field;
use super::writer::Writer;

/// Writes the view of a struct as an object.
pub(super) fn group(out: &mut Writer, ident: &str, fields: &[Field<'_>]) {
    let names: Vec<_> = fields
        .iter()
        .map(|field| field.item.name.as_str())
        .collect();
    let object = if fields.is_empty() {
        ""
    } else {
        "let object = "
    };
    begin(out, ident);
    out.push(format!("codec::view::Value::object({})", fields.len()));
    for field in fields {
        let value = format!("codec::view::View::view(&self.{})", field.ident);
        out.push(format!(".with({:?}, {value})", field.item.name));
    }
    middle(out);
    out.push(format!(
        "{object}codec::view::Object::new(value, &{names:?})?;"
    ));
    if fields.is_empty() {
        out.push("Ok(Self)");
    } else {
        out.push("Ok(Self {");
        for field in fields {
            out.push(format!(
                "{}: object.member({:?})?,",
                field.ident, field.item.name
            ));
        }
        out.push("})");
    }
    end(out, ident);
}

/// Writes the view of a struct that is shown as its only member.
pub(super) fn transparent(out: &mut Writer, ident: &str, field: &Field<'_>) {
    begin(out, ident);
    out.push(format!("codec::view::View::view(&self.{})", field.ident));
    middle(out);
    out.push(format!(
        "Ok(Self {{ {}: codec::view::View::from_view(value)? }})",
        field.ident
    ));
    end(out, ident);
}

fn begin(out: &mut Writer, ident: &str) {
    out.gap();
    out.push("codec::if_serde! {");
    out.push(format!("impl codec::view::View for {ident} {{"));
    // The registry references these functions; inlined copies would only cost space.
    out.push("#[inline(never)]\nfn view(&self) -> codec::view::Value {");
}

fn middle(out: &mut Writer) {
    out.push("}\n\n#[inline(never)]\nfn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {");
}

fn end(out: &mut Writer, ident: &str) {
    out.push(format!("}}\n}}\ncodec::serde_by_view!({ident});\n}}"));
}
