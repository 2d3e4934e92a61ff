//! Checks docs/interoperability.md: its settings parse, its commands have these flags, and it
//! covers every peer with a profile.

use crate::support::run;
use jaus::peer::Implementation;
use jaus_cli::settings;

const PAGE: &str = include_str!("../../../../../docs/interoperability.md");

/// The code blocks of a language, without their fences.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    let behind = PAGE.split(&fence).skip(1);
    behind
        .map(|rest| rest.split("```").next().unwrap())
        .collect()
}

#[test]
fn every_settings_block_can_be_read_by_a_node() {
    let blocks = blocks("toml");
    assert!(blocks.len() >= 4);
    for (number, block) in blocks.iter().enumerate() {
        let name = format!("jaus-interoperability-{}-{number}.toml", std::process::id());
        let file = std::env::temp_dir().join(name);
        // A block without an id gets one, as if from a flag.
        std::fs::write(&file, block).unwrap();
        let read = settings::read(&file);
        std::fs::remove_file(&file).unwrap();
        let (_, mut config) = read.unwrap_or_else(|error| panic!("{error}:\n{block}"));
        (config.subsystem, config.node) = (101, 1);
        config
            .validate()
            .unwrap_or_else(|error| panic!("{error}:\n{block}"));
    }
}

#[test]
fn every_command_and_flag_is_there() {
    let shown = blocks("sh");
    let blocks = shown.iter().flat_map(|block| block.lines());
    let quoted = PAGE.split('`').skip(1).step_by(2);
    let commands = blocks
        .chain(quoted)
        .filter(|text| text.starts_with("jaus "));
    let mut count = 0;
    for command in commands {
        let words: Vec<&str> = command
            .split_whitespace()
            .skip(1)
            // Placeholders, not values.
            .filter(|word| *word != "…")
            .map(|word| {
                if word == "ADDRESS" {
                    "192.168.7.2"
                } else {
                    word
                }
            })
            .chain(["--help"])
            .collect();
        let run = run(&words, b"");
        assert_eq!(run.status, 0, "{command}: {}", run.stderr);
        count += 1;
    }
    assert!(count > 8, "{count}");
}

#[test]
fn every_profile_has_its_row() {
    for peer in Implementation::ALL
        .into_iter()
        .filter(|&peer| peer != Implementation::Standard)
    {
        assert!(PAGE.contains(&format!("| `{peer}` |")), "{peer}");
    }
}

#[test]
fn settings_of_others_are_well_formed() {
    for block in blocks("xml") {
        let open = left_open(block);
        assert_eq!(open, Vec::<String>::new(), "{block}");
    }
}

/// The tags that are still open at the end.
fn left_open(text: &str) -> Vec<String> {
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let tag = tag.split('>').next().unwrap();
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap().to_owned());
        }
    }
    open
}
