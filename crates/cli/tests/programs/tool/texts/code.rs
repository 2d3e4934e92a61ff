//! Settings, XML and Rust in texts: what the programs and the compiler make of them.

use jaus_cli::settings;

use super::{Block, blocks, root, texts};

/// The pages whose Rust needs types that a build script generates, which a doctest lacks. Other tests
/// compile it: `.ci/tutorial`, the cookbook's, and `examples/own-service`.
const WITH_GENERATED_TYPES: [&str; 4] = [
    "docs/jsidl-cookbook.md",
    "docs/jsidl.md",
    "docs/library.md",
    "docs/tutorial.md",
];

/// The blocks of a language in all texts, each with its place.
fn in_all_texts(language: &str) -> Vec<(String, Block)> {
    let of_text = texts().into_iter().flat_map(|text| {
        let blocks = blocks(&text.content).into_iter();
        blocks.map(move |block| (format!("{}:{}", text.name(), block.line), block))
    });
    of_text
        .filter(|(_, block)| block.info.split(',').next() == Some(language))
        .collect()
}

#[test]
fn every_settings_block_can_be_read_by_a_program() {
    let mut count = 0;
    for (place, block) in in_all_texts("toml") {
        let is_manifest = block.content.contains("dependencies]\n");
        let is_of_a_suite = place.starts_with("crates/cli/tests/interop/");
        // For `jaus up`, which has a test of its own.
        let is_system = ["[all]\n", "[parts."]
            .iter()
            .any(|it| block.content.contains(it));
        if is_manifest || is_of_a_suite || is_system {
            continue;
        }
        let name = format!("jaus-settings-{}-{count}.toml", std::process::id());
        let file = std::env::temp_dir().join(name);
        std::fs::write(&file, &block.content).unwrap();
        let (read, flags) = (settings::read(&file), settings::flags(&file));
        std::fs::remove_file(&file).unwrap();
        let (_, mut config) = read.unwrap_or_else(|error| panic!("{place}: {error}"));
        // A block without an id gets one, as if from a flag.
        (config.subsystem, config.node) = (101, 1);
        let valid = config.validate();
        valid.unwrap_or_else(|error| panic!("{place}: {error}"));
        flags.unwrap_or_else(|error| panic!("{place}: {error}"));
        count += 1;
    }
    assert!(count > 10, "{count}");
}

#[test]
fn every_xml_block_is_well_formed() {
    let blocks = in_all_texts("xml");
    assert!(blocks.len() > 10);
    for (place, block) in blocks {
        let open = left_open(&block.content);
        assert_eq!(open, Ok(Vec::new()), "{place}");
    }
}

/// The tags that are still open at the end, or the first that closes another.
fn left_open(text: &str) -> Result<Vec<&str>, &str> {
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let tag = tag.split('>').next().unwrap_or(tag);
        if let Some(name) = tag.strip_prefix('/') {
            if open.pop() != Some(name) {
                return Err(name);
            }
        } else if !tag.ends_with('/') && !tag.starts_with(['?', '!']) {
            open.extend(tag.split_whitespace().next());
        }
    }
    Ok(open)
}

#[test]
fn every_rust_block_is_compiled_by_a_doctest_or_needs_generated_types() {
    let crates = ["src/lib.rs", "crates/vehicle/src/lib.rs"];
    let sources = crates.map(|it| std::fs::read_to_string(root().join(it)).unwrap());
    let sources = sources.concat();
    for (place, block) in in_all_texts("rust") {
        let page = place.split(':').next().unwrap();
        let is_ignored = block.info.contains("ignore");
        // A file of the tree, which is compiled as such.
        if block.content.trim_start().starts_with("{{#include ") {
            continue;
        }
        let is_listed = WITH_GENERATED_TYPES.contains(&page);
        assert!(
            is_listed || !is_ignored,
            "{place}: ignored without a reason"
        );
        let is_compiled = sources.contains(&format!("/{page}\")]"));
        assert!(is_ignored || is_compiled, "{place}: in no doctest");
    }
}
