//! Canonical layout of a definition: two blanks per level, attributes in one order, lines of at
//! most [`WIDTH`] characters, comments and text preserved. Formatting is idempotent and preserves
//! the meaning: reading folds white space in attributes and descriptions.
//!
//! A definition in the compact form (CJSIDL) stays in that form, with a layout of its own;
//! [`compact()`] brings XML into it, and [`Loader::xml`](crate::Loader::xml) back.

mod complete;

use std::path::Path;

use crate::compact;
use crate::diagnostic::{Diagnostics, Report};
use crate::layout::{self, Node, nodes};
use crate::source::Sources;
use crate::syntax;

/// Maximum line length, where words allow it.
pub const WIDTH: usize = layout::WIDTH;

/// Formats a definition. `name` is its name in findings.
///
/// # Errors
/// The findings, if the text is not XML or not a definition.
///
/// ```
/// let text = r#"<declared_const_set xmlns="urn:jaus:jsidl:1.1" id="urn:me:C" version='1.0'
///   name="C"><!-- none --></declared_const_set>"#;
/// let laid_out = jsidl::format::format("C.xml", text)?;
/// assert_eq!(laid_out, r#"<?xml version="1.0" encoding="UTF-8"?>
/// <declared_const_set name="C" id="urn:me:C" version="1.0" xmlns="urn:jaus:jsidl:1.1">
///   <!-- none -->
/// </declared_const_set>
/// "#);
/// # Ok::<(), jsidl::Diagnostics>(())
/// ```
pub fn format(name: impl AsRef<Path>, text: &str) -> Result<String, Diagnostics> {
    laid_out(name.as_ref(), text, |_| {})
}

/// As [`format()`], in the form that the standard prescribes: mandatory attributes and elements that
/// say nothing are added, and elements are put in order. What remains for the author to correct, a
/// [strict](crate::Loader::strict) check says.
///
/// # Errors
/// As [`format()`].
///
/// ```
/// let text = r#"<declared_type_set name="T" xmlns="urn:jaus:jsidl:1.1"><body name="B"/>
///   <declared_const_set_ref name="c" id="urn:me:C" version="1.0"/></declared_type_set>"#;
/// let laid_out = jsidl::format::strict("T.xml", text)?;
/// assert_eq!(laid_out, r#"<?xml version="1.0" encoding="UTF-8"?>
/// <declared_type_set name="T" xmlns="urn:jaus:jsidl:1.1">
///   <declared_const_set_ref name="c" id="urn:me:C" version="1.0"/>
///   <body name="B"/>
/// </declared_type_set>
/// "#);
/// # Ok::<(), jsidl::Diagnostics>(())
/// ```
pub fn strict(name: impl AsRef<Path>, text: &str) -> Result<String, Diagnostics> {
    laid_out(name.as_ref(), text, complete::document)
}

/// Whether a text is in the compact form (CJSIDL): it does not begin with `<`, and has the
/// extension `.csd` or `.cjsidl` or begins with a word of that form.
pub fn is_compact(name: impl AsRef<Path>, text: &str) -> bool {
    compact::is_compact(name.as_ref(), text)
}

/// Writes a definition in the compact form (CJSIDL) of the JAUS Tool Set's editor.
///
/// What that form cannot say is written into comments, which
/// [`Loader::path`](crate::Loader::path) reads and the JAUS Tool Set skips: `//@ name="value"`
/// before a construct for its attributes, `//@ element name="value"` for those of an element in it,
/// and `/*@ … */` for elements as XML. Elements of other namespaces, such as the drawings of JSIDL+,
/// are left out.
///
/// # Errors
/// As [`format()`], and if the text has several definitions (`service_set`).
///
/// ```
/// let text = r#"<declared_const_set name="C" id="urn:me:C" version="1.0" xmlns="urn:jaus:jsidl:1.1">
///   <const_def name="MOST" const_type="unsigned byte" const_value="7" field_units="one"/>
/// </declared_const_set>"#;
/// assert_eq!(jsidl::format::compact("C.xml", text)?, "constants C (id = urn.me.C, version = 1.0) {
///   uint8 MOST = 7 one;
/// }
/// ");
/// # Ok::<(), jsidl::Diagnostics>(())
/// ```
pub fn compact(name: impl AsRef<Path>, text: &str) -> Result<String, Diagnostics> {
    let mut sources = Sources::default();
    let mut report = Report::default();
    let source = sources.add(name.as_ref(), text);
    let root = if compact::is_compact(name.as_ref(), source.text()) {
        compact::read(source, &mut report)
    } else if syntax::is_definition(source, &mut report) {
        match compact::of_xml(source.text()) {
            Ok(root) => Some(root),
            Err((at, message)) => {
                report.error(source.span(at), message);
                None
            }
        }
    } else {
        None
    };
    let written = root.and_then(|root| {
        let written = compact::write(&root);
        if written.is_none() {
            let message = "the compact form has one service or set per file: split this file";
            report.error(source.span(0), message);
        }
        written
    });
    match written {
        Some(written) => Ok(written),
        None => Err(report.finish(&sources)),
    }
}

fn laid_out(
    name: &Path,
    text: &str,
    change: impl FnOnce(&mut [Node<'_>]),
) -> Result<String, Diagnostics> {
    if compact::is_compact(name, text) {
        return compact(name, text);
    }
    let mut sources = Sources::default();
    let mut report = Report::default();
    let source = sources.add(name, text);
    if !syntax::is_definition(source, &mut report) {
        return Err(report.finish(&sources));
    }
    let mut nodes = nodes(source.text());
    change(&mut nodes);
    Ok(layout::written(&nodes))
}
