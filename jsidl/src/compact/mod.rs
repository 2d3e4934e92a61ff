//! The compact form of the language (CJSIDL), as the editor of the JAUS Tool Set writes it into
//! `.csd` files: read into the same elements as XML, and written from them.
//!
//! The public grammar lacks some of what the standard can say: versions of references, widths of
//! counts, value sets with names, and more. Those are written into comments that the JAUS Tool Set
//! skips and this crate reads: `//@ name="value"` changes attributes of the following construct,
//! `//@ element name="value"` those of an element in it, and `/*@ … */` holds elements as XML.

mod amendments;
mod cursor;
mod fields;
mod known;
mod lexer;
mod machines;
mod sets;
mod tree;
mod words;
mod write;
mod write_fields;
mod write_machines;
mod writer;

use std::path::Path;

pub(crate) use known::Known;
pub(crate) use tree::Element;

use crate::diagnostic::Report;
use crate::source::{Source, Translation};

/// Extensions of files in the compact form.
pub(crate) const EXTENSIONS: [&str; 2] = ["csd", "cjsidl"];

/// Whether a text is in the compact form, by its content or its name.
pub(crate) fn is_compact(name: &Path, text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with('<') {
        return false;
    }
    has_extension(name) || begins(text)
}

/// Whether a file has an extension of the compact form.
pub(crate) fn has_extension(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|it| {
        EXTENSIONS
            .iter()
            .any(|known| it.eq_ignore_ascii_case(known))
    })
}

/// Whether the first word after comments is one with which a file begins, and a name follows.
fn begins(text: &str) -> bool {
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let comment = if rest.starts_with("//") {
            rest.find('\n')
        } else if rest.starts_with("/*") {
            rest.find("*/").map(|it| it + 2)
        } else {
            break;
        };
        let Some(length) = comment else { return false };
        rest = &rest[length..];
    }
    sets::ROOTS.iter().any(|word| {
        let after = rest.strip_prefix(word);
        after.is_some_and(|it| it.starts_with(char::is_whitespace))
    })
}

/// Reads a text in the compact form. Mistakes are reported; then there is no element.
pub(crate) fn read(source: &Source, report: &mut Report) -> Option<Element> {
    let before = report.errors();
    let mut add = |fault: lexer::Fault| {
        report.error(source.span(fault.at), fault.message);
    };
    let mut root = None;
    match cursor::Cursor::new(source.text()) {
        Err(fault) => add(fault),
        Ok(mut cursor) => {
            match cursor.file() {
                Ok(found) => root = Some(found),
                Err(fault) => cursor.fault(fault),
            }
            std::mem::take(&mut cursor.faults).into_iter().for_each(add);
        }
    }
    root.filter(|_| report.errors() == before)
}

/// Completes a text of the compact form from the other definitions of a load, and translates it
/// into XML. Mistakes are reported.
pub(crate) fn translate(
    mut root: Element,
    known: &Known,
    source: &Source,
    report: &mut Report,
) -> Translation {
    machines::flat(&mut root);
    root.in_order();
    let (errors, warnings) = known.complete(&mut root);
    for fault in errors {
        report.error(source.span(fault.at), fault.message);
    }
    for fault in warnings {
        report.warning(source.span(fault.at), fault.message);
    }
    root.to_xml()
}

/// The elements of an XML text that is known to be a definition.
pub(crate) fn of_xml(text: &str) -> Result<Element, (usize, String)> {
    Element::from_xml(text)
}

/// Writes a definition in the compact form. A service set has none.
pub(crate) fn write(root: &Element) -> Option<String> {
    write::document(root)
}
