//! Canonical layout of a definition: two blanks per level, attributes in one order, lines of at
//! most [`WIDTH`] characters, comments and text preserved. Formatting is idempotent and preserves
//! the meaning: reading folds white space in attributes and descriptions.

mod complete;
mod read;
mod write;

use std::path::Path;

use crate::diagnostic::{Diagnostics, Report};
use crate::source::Sources;
use crate::syntax;

/// Maximum line length, where words allow it.
pub const WIDTH: usize = 116;

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

fn laid_out(
    name: &Path,
    text: &str,
    change: impl FnOnce(&mut [read::Node<'_>]),
) -> Result<String, Diagnostics> {
    let mut sources = Sources::default();
    let mut report = Report::default();
    let source = sources.add(name, text);
    if !syntax::is_definition(source, &mut report) {
        return Err(report.finish(&sources));
    }
    let mut nodes = read::nodes(source.text());
    change(&mut nodes);
    Ok(write::document(&nodes))
}
