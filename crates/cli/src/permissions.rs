//! What messages need, with definitions of one's own.

use std::path::PathBuf;

use jaus::rights::Table;
use jsidl::Loader;
use jsidl::permission::Permissions;

use crate::failure::Failure;

/// The catalogue's table, with the messages of these JSIDL files and folders.
///
/// # Errors
/// Definitions with mistakes, or a message of which they do not state what its sender needs.
pub fn table_with(paths: &[PathBuf]) -> Result<Table, Failure> {
    if paths.is_empty() {
        return Ok(Table::default());
    }
    let mut loader = Loader::new();
    loader.catalogue();
    for path in paths {
        loader.path(path);
    }
    let loaded = loader.load();
    if loaded.diagnostics.has_errors() {
        return Err(Failure::new(loaded.diagnostics.to_string()));
    }
    let permissions = Permissions::of(&loaded.library);
    if let Some(message) = permissions.missing.first() {
        let (place, name) = (&message.location, &message.name);
        return Err(Failure::new(format!(
            "{place}: `{name}` does not state what its sender needs: write `own:permission=\"command\"` into \
             its `message_def`, or `observe` if it changes nothing, or another right (docs/jsidl.md), and \
             `xmlns:own=\"urn:jaus-rs:jsidl\"` into the root of the file"
        )));
    }
    Table::default()
        .with(&permissions.to_string())
        .map_err(Failure::of)
}
