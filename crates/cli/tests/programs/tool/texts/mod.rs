//! The texts for users: README and the pages of the book. Their links lead somewhere, their commands,
//! settings and definitions are those of the programs, and their sessions print what they show.

mod code;
mod commands;
mod cookbook;
mod evidence;
mod links;
mod sessions;

use std::fs;
use std::path::{Path, PathBuf};

/// Folders whose texts are checked.
const FOLDERS: [&str; 8] = [
    "",
    "docs",
    "packaging",
    "benches/socketio",
    "crates/cli/tests/interop",
    "fuzz",
    "jsidl/services",
    "tests/evidence",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

struct Text {
    path: PathBuf,
    content: String,
}

impl Text {
    /// The file's name with the folder, such as `docs/safety.md`.
    fn name(&self) -> String {
        self.path
            .strip_prefix(root())
            .unwrap()
            .display()
            .to_string()
    }
}

/// All texts, in a fixed order.
fn texts() -> Vec<Text> {
    let files = FOLDERS.iter().flat_map(|folder| {
        let files = fs::read_dir(root().join(folder)).unwrap();
        files.map(|it| it.unwrap().path())
    });
    let mut paths: Vec<_> = files
        .filter(|it| it.extension().is_some_and(|it| it == "md"))
        .collect();
    paths.sort();
    let read = |path: PathBuf| Text {
        content: fs::read_to_string(&path).unwrap(),
        path,
    };
    paths.into_iter().map(read).collect()
}

/// A block of code between fences.
#[derive(Default)]
struct Block {
    /// What follows the opening fence, such as `rust,no_run`.
    info: String,
    content: String,
    /// The number of the opening fence's line.
    line: usize,
}

/// Splits a text into its code blocks and the lines outside them.
fn split(text: &str) -> (Vec<Block>, String) {
    let (mut blocks, mut prose) = (Vec::new(), String::new());
    let mut open: Option<(Block, usize)> = None;
    for (number, line) in text.lines().enumerate() {
        let bare = line.trim_start();
        match (bare.strip_prefix("```"), &mut open) {
            (Some(info), None) => {
                let block = Block {
                    info: info.to_owned(),
                    line: number + 1,
                    ..Block::default()
                };
                open = Some((block, line.len() - bare.len()));
            }
            (Some(_), Some(_)) => blocks.extend(open.take().map(|(block, _)| block)),
            (None, Some((block, indent))) => {
                block.content += line.get(*indent..).unwrap_or_default();
                block.content.push('\n');
            }
            (None, None) => {
                prose += line;
                prose.push('\n');
            }
        }
    }
    assert!(open.is_none(), "a code block has no end");
    (blocks, prose)
}

fn blocks(text: &str) -> Vec<Block> {
    split(text).0
}

/// A text without its code blocks.
fn prose(text: &str) -> String {
    split(text).1
}
