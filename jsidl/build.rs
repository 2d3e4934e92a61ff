//! Embeds every definition under `services`, so that adding a file needs no code.
//!
//! Writes `catalogue.rs` to `OUT_DIR`: a table of the files by set (the first directory), each with
//! what its root element declares and its text, which is packed: the texts of all sets would be a
//! good part of a small program.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use miniz_oxide::deflate::compress_to_vec;

/// The level of compression that takes the longest and gives the least.
const BEST: u8 = 10;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=services");
    let services = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("services");
    let mut files = Vec::new();
    definitions(&services, &mut files)?;
    files.sort();
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let mut table = String::from("[\n");
    for (number, file) in files.iter().enumerate() {
        let packed = out.join(format!("{number}.deflate"));
        entry(&services, file, &packed, &mut table)
            .map_err(|error| format!("{}: {error}", file.display()))?;
    }
    table.push(']');
    fs::write(out.join("catalogue.rs"), table)?;
    Ok(())
}

fn definitions(directory: &Path, files: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(directory)? {
        let path = entry?.path();
        if path.is_dir() {
            definitions(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "xml") {
            files.push(path);
        }
    }
    Ok(())
}

fn entry(
    services: &Path,
    file: &Path,
    packed: &Path,
    table: &mut String,
) -> Result<(), Box<dyn Error>> {
    let text = fs::read_to_string(file)?;
    fs::write(packed, compress_to_vec(text.as_bytes(), BEST))?;
    let document = roxmltree::Document::parse(&text)?;
    let root = document.root_element();
    let attribute = |name| {
        root.attribute(name)
            .ok_or_else(|| format!("the root element lacks the attribute `{name}`"))
    };
    let parts: Vec<_> = file
        .strip_prefix(services)?
        .iter()
        .map(|part| part.to_str().ok_or("the path is not UTF-8"))
        .collect::<Result<_, _>>()?;
    let set = match parts.as_slice() {
        [set, _, ..] => set,
        _ => return Err("definitions belong in the directory of a set".into()),
    };
    writeln!(
        table,
        "Entry {{ set: {set:?}, path: {:?}, element: {:?}, urn: {:?}, version: {:?}, packed: include_bytes!({:?}) }},",
        parts.join("/"),
        root.tag_name().name(),
        attribute("id")?,
        attribute("version")?,
        packed,
    )?;
    Ok(())
}
