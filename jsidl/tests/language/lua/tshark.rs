//! Runs `tshark` with a generated script and parses its output.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use jsidl::Library;
use roxmltree::{Document, Node};

/// A separate directory for the test.
pub(crate) fn directory(test: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("lua")
        .join(test);
    fs::create_dir_all(&directory).unwrap();
    directory
}

/// The tshark output for a capture, as PDML: every packet with the items of the JAUS protocol.
///
/// # Panics
/// If tshark reports an error, for instance in the Lua script.
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
    // tshark truncates long labels, possibly within a character.
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

/// The items of a packet that represent JAUS messages.
pub(crate) fn messages<'a, 'p>(packet: Node<'a, 'p>) -> Vec<Node<'a, 'p>> {
    packet
        .children()
        .filter(|node| name(*node) == "jaus")
        .collect()
}

pub(crate) fn name<'a>(node: Node<'a, '_>) -> &'a str {
    node.attribute("name").unwrap_or_default()
}

/// The shown value of the first field of this name anywhere within an item.
pub(crate) fn show<'a>(item: Node<'a, '_>, field: &str) -> Option<&'a str> {
    item.descendants()
        .find(|node| name(*node) == field)
        .and_then(|node| node.attribute("show"))
}

/// The texts of the expert infos of a kind.
pub(crate) fn experts<'a>(item: Node<'a, '_>, kind: &str) -> Vec<&'a str> {
    item.descendants()
        .filter(|node| name(*node) == kind)
        .filter_map(|node| node.attribute("showname"))
        .collect()
}
