//! The recipes of docs/jsidl-cookbook.md: the compiler accepts each, and generates the shown Rust.

use std::path::{Path, PathBuf};

use super::{Block, blocks, root};
use crate::support::run;

/// Comments of the frame, which messages replace.
const QUERIES: &str = "<!-- further commands and queries -->";
const REPORTS: &str = "<!-- further reports -->";

#[test]
fn every_recipe_is_accepted_and_generates_the_shown_rust() {
    let page = std::fs::read_to_string(root().join("docs/jsidl-cookbook.md")).unwrap();
    let frame = blocks(&page).swap_remove(0).content;
    assert!(frame.contains(QUERIES) && frame.contains(REPORTS));
    let mut count = 0;
    for recipe in page.split("\n## ").skip(1) {
        let (name, _) = recipe.split_once('\n').unwrap();
        let blocks = blocks(recipe);
        let (definitions, rust): (Vec<_>, Vec<_>) =
            blocks.into_iter().partition(|it| it.info == "xml");
        if definitions.is_empty() {
            continue;
        }
        let folder = written(&frame, &definitions);
        let generated = compiled(&folder, name);
        std::fs::remove_dir_all(&folder).unwrap();
        for block in rust {
            for word in generated_names(&block.content) {
                assert!(
                    generated.contains(word),
                    "{name}: `{word}` is not generated"
                );
            }
        }
        count += 1;
    }
    assert!(count > 10, "{count}");
}

/// Writes the definitions of a recipe to a folder: whole files, and messages within the frame.
fn written(frame: &str, definitions: &[Block]) -> PathBuf {
    let name = format!(
        "jaus-cookbook-{}-{}",
        std::process::id(),
        definitions[0].line
    );
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let mut framed = frame.to_owned();
    for (number, block) in definitions.iter().enumerate() {
        let text = &block.content;
        if !text.starts_with("<message_def") {
            std::fs::write(folder.join(format!("{number}.xml")), text).unwrap();
            continue;
        }
        let place = if text.contains("message_id=\"F") {
            REPORTS
        } else {
            QUERIES
        };
        framed = framed.replace(place, &format!("{text}{place}"));
    }
    if framed != frame {
        std::fs::write(folder.join("frame.xml"), framed).unwrap();
    }
    folder
}

/// Checks the definitions of a folder; returns the Rust that they generate.
fn compiled(folder: &Path, name: &str) -> String {
    let path = folder.to_str().unwrap();
    let checked = run(&["jsidl", "check", "--deny-warnings", path], b"");
    assert_eq!(checked.status, 0, "{name}: {}", checked.stdout);
    let output = folder.join("out");
    let emitted = run(
        &["jsidl", "rust", path, "-o", output.to_str().unwrap()],
        b"",
    );
    assert_eq!(emitted.status, 0, "{name}: {}", emitted.stderr);
    std::fs::read_to_string(output.join("messages.rs")).unwrap()
}

/// The names in a snippet that the compiler must have generated: types with their constants, and
/// fields and methods of several words. Those of the library and of the reader are left out.
fn generated_names(snippet: &str) -> impl Iterator<Item = &str> {
    const OTHERS: [&str; 9] = [
        "Call",
        "Duration",
        "Some",
        "Handlers",
        "Option",
        "Bytes",
        "raise_after",
        "and_version",
        "from_secs",
    ];
    let code = snippet
        .lines()
        .map(|line| line.split("//").next().unwrap_or(line));
    let outside_strings = code.flat_map(|line| line.split('"').step_by(2));
    let words = outside_strings.flat_map(|it| it.split(|c: char| !c.is_alphanumeric() && c != '_'));
    words.filter(|word| {
        let is_type = word.starts_with(|c: char| c.is_ascii_uppercase());
        let is_method = word.contains('_') && word.len() > 1;
        let is_of_the_reader = word.starts_with("My") || *word == "switch_off";
        (is_type || is_method) && !is_of_the_reader && !OTHERS.contains(word)
    })
}
