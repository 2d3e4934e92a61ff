//! Writes a module and a type stub for each set of messages to `OUT_DIR`, from where maturin puts
//! them into the wheel (`pyproject.toml`).

use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut loader = jsidl::Loader::new();
    loader.catalogue();
    let library = loader.load().library;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    for (file, stub) in jsidl::python::files(&library, |_| true) {
        let file = out.join(file);
        fs::write(&file, stub)?;
        fs::write(file.with_extension("py"), MODULE)?;
    }
    Ok(())
}

/// A module whose members are made when they are used.
const MODULE: &str = "\
\"\"\"Typed messages, made from the definitions of their services when they are used.\"\"\"

from jaus.messages._library import builtin

_set = builtin().set(__name__.rpartition(\".\")[2])
__all__ = _set.names()


def __getattr__(name):
    return getattr(_set, name)


def __dir__():
    return dir(_set)
";
