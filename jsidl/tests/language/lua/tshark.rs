//! Runs `tshark` with a generated script, and reads what it prints.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use jsidl::Library;
use roxmltree::{Document, Node};

/// A directory of this test's own.
pub(crate) fn directory(test: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("lua")
        .join(test);
    fs::create_dir_all(&directory).unwrap();
    directory
}

/// What tshark prints about a capture, as PDML: every packet with the items of the JAUS protocol.
///
/// # Panics
/// If tshark complains, which it does about errors in Lua.
pub(crate) fn pdml(library: &Library, directory: &Path, capture: &Path) -> String {
    let script = directory.join("jaus.lua");
    fs::write(&script, jsidl::lua::dissector(library)).unwrap();
    let output = Command::new("tshark")
        .env("HOME", directory)
        .env("XDG_CONFIG_HOME", directory)
        .args(["-n", "-T", "pdml", "-J", "jaus jtcp", "-X"])
        .arg(format!("lua_script:{}", script.display()))
        .arg("-r")
        .arg(capture)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    let unexpected: Vec<_> = errors
        .lines()
        .filter(|line| !line.trim().is_empty() && !line.contains("user \"root\""))
        .collect();
    assert!(output.status.success() && unexpected.is_empty(), "{errors}");
    // Long labels end in the middle of a character.
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for fault in [
        "_ws.lua.error",
        "Lua Error",
        "jaus.fault",
        "Trying to fetch",
    ] {
        if let Some(at) = text.find(fault) {
            let shown: String = text[at..].chars().take(600).collect();
            panic!("{}: {shown}", capture.display());
        }
    }
    text
}

/// The packets of PDML.
pub(crate) fn packets<'a, 'p>(pdml: &'a Document<'p>) -> Vec<Node<'a, 'p>> {
    let root = pdml.root_element();
    root.children()
        .filter(|node| node.has_tag_name("packet"))
        .collect()
}

/// The items of a packet that stand for a JAUS message each.
pub(crate) fn messages<'a, 'p>(packet: Node<'a, 'p>) -> Vec<Node<'a, 'p>> {
    packet
        .children()
        .filter(|node| name(*node) == "jaus")
        .collect()
}

pub(crate) fn name<'a>(node: Node<'a, '_>) -> &'a str {
    node.attribute("name").unwrap_or_default()
}

/// What stands in the field of this name anywhere inside of an item.
pub(crate) fn show<'a>(item: Node<'a, '_>, field: &str) -> Option<&'a str> {
    item.descendants()
        .find(|node| name(*node) == field)
        .and_then(|node| node.attribute("show"))
}

/// The sentences of the expert infos of a kind.
pub(crate) fn experts<'a>(item: Node<'a, '_>, kind: &str) -> Vec<&'a str> {
    item.descendants()
        .filter(|node| name(*node) == kind)
        .filter_map(|node| node.attribute("showname"))
        .collect()
}
