//! Writes down every message of the definitions, for the rules: what a key may do does not depend on the sets that a
//! program was built with.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, fs};

use jsidl::Loader;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut loader = Loader::new();
    loader.catalogue();
    let loaded = loader.load();
    if loaded.diagnostics.has_errors() {
        return Err(loaded.diagnostics.to_string().into());
    }
    let library = loaded.library;
    // Several services may give the same code to the same message, or call it a command or not.
    let mut messages: BTreeMap<(u16, &str), bool> = BTreeMap::new();
    let mut services: BTreeMap<&str, BTreeSet<u16>> = BTreeMap::new();
    for service in library.services() {
        for message in service.messages() {
            let known = messages.entry((message.code, &message.name));
            *known.or_default() |= message.is_command;
        }
        let inputs = services.entry(&service.id.urn).or_default();
        inputs.extend(service.inputs.iter().map(|it| it.code));
    }
    let mut table = String::new();
    writeln!(table, "static MESSAGES: &[(u16, &str, bool)] = &[")?;
    for ((code, name), is_command) in messages {
        writeln!(table, "    (0x{code:04X}, {name:?}, {is_command}),")?;
    }
    writeln!(table, "];\nstatic SERVICES: &[(&str, &[u16])] = &[")?;
    for (urn, inputs) in services {
        let inputs: Vec<_> = inputs.into_iter().collect();
        writeln!(table, "    ({urn:?}, &{inputs:?}),")?;
    }
    writeln!(table, "];")?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    Ok(fs::write(out.join("known.rs"), table)?)
}
