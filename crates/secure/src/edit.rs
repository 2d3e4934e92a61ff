//! Changes of a trust file: a peer is added or removed, and the rest of the file stays as it is.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use crate::rules::Rules;
use crate::trust::{Peer, Trust, TrustError, line_of};

/// Adds a peer to a trust file, which is created if necessary.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or lists the key or name already.
pub fn trust(path: &Path, peer: &Peer) -> Result<(), TrustError> {
    let mut text = text_of(path)?;
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    text.push_str(&line_of(peer));
    Trust::parse(&text)?;
    replace(path, &text)
}

/// Replaces the rules of the peer with this name; returns whether it was there. A running node
/// applies them within seconds.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn allow(path: &Path, name: &str, rules: &Rules) -> Result<bool, TrustError> {
    let text = text_of(path)?;
    let trust = Trust::parse(&text)?;
    let Some(peer) = trust.peers().iter().find(|it| it.name == name) else {
        return Ok(false);
    };
    let line = line_of(&Peer {
        rules: rules.clone(),
        ..peer.clone()
    });
    let changed: String = text
        .lines()
        .map(|it| {
            if is_of(name, it) {
                line.clone()
            } else {
                format!("{it}\n")
            }
        })
        .collect();
    replace(path, &changed)?;
    Ok(true)
}

/// Removes the peer with this name from a trust file; returns whether it was there. A running node
/// closes its session within seconds.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn revoke(path: &Path, name: &str) -> Result<bool, TrustError> {
    let text = text_of(path)?;
    Trust::parse(&text)?;
    let rest: Vec<_> = text.lines().filter(|line| !is_of(name, line)).collect();
    if rest.len() == text.lines().count() {
        return Ok(false);
    }
    let rest: String = rest.iter().flat_map(|line| [*line, "\n"]).collect();
    replace(path, &rest)?;
    Ok(true)
}

/// Whether a line is that of the peer with this name.
fn is_of(name: &str, line: &str) -> bool {
    line.split_whitespace().next() == Some(name)
}

fn text_of(path: &Path) -> Result<String, TrustError> {
    match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(String::new()),
        other => other.map_err(|source| in_file(path, source)),
    }
}

/// Replaces a file in one step, so that a reader finds the old or the new text.
fn replace(path: &Path, text: &str) -> Result<(), TrustError> {
    let draft = path.with_extension("new");
    let write = || -> io::Result<()> {
        let mut file = File::create(&draft)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&draft, path)
    };
    write().map_err(|source| in_file(path, source))
}

fn in_file(path: &Path, source: io::Error) -> TrustError {
    TrustError::File {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::key::PublicKey;

    fn peer(name: &str, octet: u8) -> Peer {
        Peer {
            name: name.to_owned(),
            key: PublicKey::from_octets([octet; 32]),
            ids: vec!["101.255.255".parse().unwrap(), "102.1.1".parse().unwrap()],
            rules: Rules::default(),
        }
    }

    #[test]
    fn peers_are_added_and_removed_and_comments_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, "# our team").unwrap();
        trust(&path, &peer("rover", 1)).unwrap();
        trust(&path, &peer("console", 2)).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nrover "), "{text}");
        assert_eq!(
            Trust::parse(&text).unwrap().peers(),
            [peer("rover", 1), peer("console", 2)]
        );
        assert!(revoke(&path, "rover").unwrap());
        assert!(!revoke(&path, "rover").unwrap());
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nconsole "), "{text}");
    }

    #[test]
    fn the_rules_of_a_peer_are_replaced_and_the_other_lines_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, "# our team\n").unwrap();
        trust(&path, &peer("rover", 1)).unwrap();
        trust(&path, &peer("console", 2)).unwrap();
        let rules: Rules = "control=127 with=101.255.255".parse().unwrap();
        assert!(allow(&path, "console", &rules).unwrap());
        assert!(!allow(&path, "tablet", &rules).unwrap());
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nrover "), "{text}");
        let peers = Trust::parse(&text).unwrap();
        assert_eq!(peers.peers()[0], peer("rover", 1));
        assert_eq!(peers.peers()[1].rules, rules);
    }

    #[test]
    fn a_change_that_would_make_the_file_unusable_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        trust(&path, &peer("rover", 1)).unwrap();
        let before = fs::read_to_string(&path).unwrap();
        for bad in [peer("rover", 2), peer("other", 1), peer("two words", 3)] {
            assert!(trust(&path, &bad).is_err(), "{bad:?}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), before);
    }
}
