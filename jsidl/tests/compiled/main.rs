//! Generated Rust through the compiler: it accepts the code of every legal definition, without a
//! warning. And hostile definitions through every generator.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on fails"
)]

mod cases;
mod chance;
mod definitions;
mod guards;
mod hostile;
mod rustc;
mod words;

use jsidl::Loader;

/// The generated module of legal definitions.
pub(crate) fn emitted(files: &[String]) -> String {
    let mut loader = Loader::new();
    for (number, text) in files.iter().enumerate() {
        loader.text(format!("{number}.xml"), text);
    }
    let loaded = loader.load();
    let errors = loaded.diagnostics.to_string();
    assert!(!errors.contains("error: "), "{errors}\n{}", files.concat());
    let services = loaded.library.services().map(AsRef::as_ref);
    jsidl::rust::module(&loaded.library, services, "::jaus_codec")
}

/// The number in an environment variable.
pub(crate) fn number(name: &str, default: u64) -> u64 {
    let value = std::env::var(name).ok();
    value.and_then(|it| it.parse().ok()).unwrap_or(default)
}

/// Compiles the modules of several random definitions, and names the first that the compiler refuses.
fn compiles(seeds: std::ops::Range<u64>) {
    let modules: Vec<_> = seeds
        .clone()
        .map(|seed| emitted(&definitions::random(seed)))
        .collect();
    if rustc::check(&modules).is_ok() {
        return;
    }
    for (seed, module) in seeds.zip(&modules) {
        if let Err(errors) = rustc::check(std::slice::from_ref(module)) {
            panic!(
                "seed {seed}:\n{errors}\n{}",
                definitions::random(seed).concat()
            );
        }
    }
    panic!("the modules compile alone, but not together");
}

#[test]
fn random_legal_definitions_compile() {
    compiles(0..12);
}

/// `JAUS_CASES` of them, from the seed `JAUS_SEED`.
#[test]
#[ignore = "takes as long as one wants: see .ci/full"]
fn many_random_legal_definitions_compile() {
    let (first, cases) = (number("JAUS_SEED", 1000), number("JAUS_CASES", 400));
    for next in (first..first.saturating_add(cases)).step_by(40) {
        compiles(next..next + 40);
    }
    println!("{cases} definitions compile");
}

/// Without the services' machines, traits and tables.
#[test]
fn the_code_of_a_message_has_fewer_than_130_lines() {
    let mut loader = Loader::new();
    loader.catalogue();
    let library = loader.load().library;
    let services = library.services().map(AsRef::as_ref);
    let module = jsidl::rust::module(&library, services, "::jaus_codec");
    let number = module.matches("codec::MessageInfo::of").count();
    let (_, tables) = module.split_once("pub static MESSAGES").unwrap();
    let (_, messages) = tables.split_once("pub mod ").unwrap();
    let lines = messages.lines().count();
    println!("{lines} lines, {number} messages");
    assert!(lines / number < 130, "{lines} lines, {number} messages");
}
