//! Unpacks the evidence of the repository.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;

fn main() -> io::Result<()> {
    let packed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/evidence");
    println!("cargo::rerun-if-changed={}", packed.display());
    let unpacked = std::env::var_os("OUT_DIR").map(PathBuf::from);
    let unpacked = unpacked.ok_or_else(|| io::Error::other("OUT_DIR is not set"))?;
    ["golden", "captures"]
        .iter()
        .try_for_each(|folder| unpack(&packed.join(folder), &unpacked.join(folder)))
}

/// Unpacks a folder and those in it.
fn unpack(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path = entry?.path();
        let to = to.join(path.file_stem().unwrap_or_default());
        if path.is_dir() {
            unpack(&path, &to)?;
        } else {
            io::copy(
                &mut GzDecoder::new(File::open(&path)?),
                &mut File::create(to)?,
            )?;
        }
    }
    Ok(())
}
