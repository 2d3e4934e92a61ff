//! The compiler that built this test, on generated modules.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Checks modules in one crate, which has no other dependency than the codec, and no standard library.
///
/// # Errors
/// The compiler's errors and warnings.
pub(crate) fn check(modules: &[String]) -> Result<(), String> {
    let mut text = String::from("#![no_std]\n#![deny(warnings)]\n");
    for (number, module) in modules.iter().enumerate() {
        text += &format!("pub mod case_{number} {{\n{module}\n}}\n");
    }
    static CODEC: OnceLock<PathBuf> = OnceLock::new();
    run(&text, CODEC.get_or_init(codec))
}

/// Compiles modules with a `main` function, and runs it.
///
/// # Errors
/// The compiler's errors, or what the program printed before it failed.
pub(crate) fn execute(module: &str, main: &str) -> Result<(), String> {
    let codec = codec();
    let program = unused_path();
    let source = program.with_extension("rs");
    let text = format!("#![allow(dead_code)]\nmod case {{\n{module}\n}}\n{main}");
    fs::write(&source, text).unwrap();
    let output = compiler(&codec)
        .arg("-o")
        .arg(&program)
        .arg(&source)
        .output()
        .unwrap();
    let _ = fs::remove_file(&source);
    let said = |output: &std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        return Err(said(&output));
    }
    let output = Command::new(&program).output().unwrap();
    let _ = fs::remove_file(&program);
    match output.status.success() {
        true => Ok(()),
        false => Err(said(&output)),
    }
}

/// The compiler with what every compilation needs.
fn compiler(codec: &Path) -> Command {
    let mut codec_is = std::ffi::OsString::from("jaus_codec=");
    codec_is.push(codec);
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut command = Command::new(rustc);
    command
        .args(["--edition", "2024", "--error-format", "short", "--extern"])
        .arg(codec_is)
        .arg("-L")
        .arg(format!("dependency={}", codec.parent().unwrap().display()));
    command
}

/// The library of the codec that was built with this test: the newest that a crate can use with the
/// dependencies beside it.
fn codec() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let libraries = fs::read_dir(test.parent().unwrap()).unwrap();
    let libraries = libraries.map(|entry| entry.unwrap().path()).filter(|path| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.starts_with("libjaus_codec-") && name.ends_with(".rlib")
    });
    let mut libraries: Vec<_> = libraries.collect();
    libraries.sort_by_key(|path| std::cmp::Reverse(path.metadata().unwrap().modified().unwrap()));
    let uses_features = "#![no_std]\npub use jaus_codec::{arbitrary, view, LargeArray};";
    let found = libraries.iter().find(|it| run(uses_features, it).is_ok());
    found
        .cloned()
        .expect("the codec's library is a dependency of this test")
}

/// A path for the files of one compilation, beside those of the tests that run at the same time.
fn unused_path() -> PathBuf {
    static PATHS: AtomicU32 = AtomicU32::new(0);
    let number = PATHS.fetch_add(1, Ordering::Relaxed);
    let name = format!("generated_{}_{number}", std::process::id());
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn run(text: &str, codec: &Path) -> Result<(), String> {
    let source = unused_path().with_extension("rs");
    let metadata = source.with_extension("rmeta");
    fs::write(&source, text).unwrap();
    let output = compiler(codec)
        .args(["--crate-type", "lib", "--emit", "metadata", "-o"])
        .arg(&metadata)
        .arg(&source)
        .output()
        .unwrap();
    let _ = (fs::remove_file(&source), fs::remove_file(&metadata));
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}
