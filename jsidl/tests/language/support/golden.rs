//! The golden encodings of an independent code generator, and the definitions that they belong to.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::Library;
use jsidl::model::{Id, Message, Version};
use serde_json::Value as Json;

/// The name of each source, with its vectors.
pub(crate) fn sources() -> Vec<(String, Vec<Json>)> {
    let entries = fs::read_dir(evidence::golden()).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let name = |file: &PathBuf| file.file_stem().unwrap().to_str().unwrap().to_owned();
    let sources = files.iter().map(|file| (name(file), file));
    sources
        .filter(|(name, _)| !name.starts_with("scaling_"))
        .map(|(name, file)| (name, lines(file)))
        .collect()
}

/// The lines of a file of golden data.
pub(crate) fn lines(path: &Path) -> Vec<Json> {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The directories with the definitions of a source, its own first.
fn directories(corpus: &Path, source: &str) -> Vec<PathBuf> {
    // Sets of one family use each other's types and services.
    match source.split_once('-') {
        Some(("jts", "examples")) => vec![corpus.join(source), corpus.join("jts")],
        Some((family, set)) => {
            let family = corpus.join(family);
            vec![family.join(format!("urn.jaus.jss.{set}")), family]
        }
        None => vec![corpus.join(source)],
    }
}

pub(crate) fn load(corpus: &Path, source: &str) -> Library {
    let mut loader = jsidl::Loader::new();
    for directory in directories(corpus, source) {
        loader.path(directory);
    }
    loader.load().library
}

pub(crate) fn id_of(row: &Json) -> Id {
    let (major, minor) = row["version"].as_str().unwrap().split_once('.').unwrap();
    let version = Version {
        major: major.parse().unwrap(),
        minor: minor.parse().unwrap(),
    };
    Id {
        urn: row["service_id"].as_str().unwrap().into(),
        version,
    }
}

pub(crate) fn message_of<'a>(library: &'a Library, row: &Json) -> &'a Message {
    let id = id_of(row);
    let service = library
        .service(&id)
        .unwrap_or_else(|| panic!("service {id} is not loaded"));
    let code = u16::from_str_radix(row["message_id"].as_str().unwrap(), 16).unwrap();
    let mut messages = service.messages();
    messages
        .find(|message| message.code == code && row["message"] == message.name)
        .unwrap_or_else(|| panic!("{id} has no message {} {code:04X}h", row["message"]))
}

pub(crate) fn octets_of(hex: &Json) -> Vec<u8> {
    let hex = hex.as_str().unwrap().as_bytes();
    let octet = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    hex.chunks(2).map(octet).collect()
}
