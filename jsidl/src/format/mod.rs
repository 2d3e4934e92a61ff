//! Canonical layout of a definition: two blanks per level, attributes in one order, lines of at
//! most [`WIDTH`] characters, comments and text preserved. Formatting is idempotent and preserves
//! the meaning: reading folds white space in attributes and descriptions.

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
    let mut sources = Sources::default();
    let mut report = Report::default();
    let source = sources.add(name.as_ref(), text);
    if !syntax::is_definition(source, &mut report) {
        return Err(report.finish(&sources));
    }
    Ok(write::document(&read::nodes(source.text())))
}
