//! Changes of a trust file: a peer is added or removed, and the rest of the file stays as it is.

use std::fmt::Display;
use std::path::Path;

use jaus_files::{Readers, edit, read_text};

use crate::key::PublicKey;
use crate::trust::{CERTIFICATE, Grant, LONGEST, Peer, Trust, TrustError, in_file};
use jaus::rights::Rules;

/// Adds a peer to a trust file, which is created if necessary. A name that has a key already gets
/// another one only if `also` says so.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or lists the key or name already.
pub fn trust(path: &Path, peer: &Peer, also: bool) -> Result<(), TrustError> {
    change(path, |text| {
        let known = Trust::parse(text)?;
        if !also && known.peers().iter().any(|it| it.name == peer.name) {
            return Err(TrustError::Known(peer.name.clone()));
        }
        Ok(Some(with_line(text, peer)))
    })?;
    Ok(())
}

/// Adds the line for a certificate to a trust file, which is created if necessary.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or has a line for the certificate
/// already.
pub fn grant(path: &Path, grant: &Grant) -> Result<(), TrustError> {
    change(path, |text| Ok(Some(with_line(text, grant))))?;
    Ok(())
}

/// Adds an approved line to a trust file, in place of the line for the same key or certificate.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn put(path: &Path, line: &str) -> Result<(), TrustError> {
    let subject = |line: &str| {
        let mut words = line.split_whitespace().map(str::to_owned);
        let (name, proof) = (words.next(), words.next());
        (name.filter(|_| is_grant(line)), proof)
    };
    change(path, |text| {
        let others = text.lines().filter(|it| subject(it) != subject(line));
        let others: String = others.flat_map(|line| [line, "\n"]).collect();
        Ok(Some(with_line(&others, line)))
    })?;
    Ok(())
}

fn with_line(text: &str, line: impl Display) -> String {
    let end = match text.is_empty() || text.ends_with('\n') {
        true => "",
        false => "\n",
    };
    format!("{text}{end}{line}\n")
}

/// Replaces the rules of the peer or certificate with this name; returns whether it was there. A
/// running node applies them within two seconds.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn allow(path: &Path, name: &str, rules: &Rules) -> Result<bool, TrustError> {
    change(path, |text| {
        Trust::parse(text)?;
        if !text.lines().any(|line| is_of(name, line)) {
            return Ok(None);
        }
        let mut changed = String::new();
        for line in text.lines() {
            if is_of(name, line) {
                changed.push_str(&with_rules(line, rules)?);
            } else {
                changed.extend([line, "\n"]);
            }
        }
        Ok(Some(changed))
    })
}

/// The lines of a trust file for the peer or certificate with this name, with these rules.
///
/// # Errors
/// If the file cannot be read, or has a malformed line.
pub fn allowed(path: &Path, name: &str, rules: &Rules) -> Result<Vec<String>, TrustError> {
    let text = read_text(path, Readers::Everyone, LONGEST).map_err(|it| in_file(path, it))?;
    let lines = text.lines().filter(|line| is_of(name, line));
    let lines = lines.map(|line| Ok(with_rules(line, rules)?.trim_end().to_owned()));
    lines.collect()
}

/// A line of a trust file with other rules.
fn with_rules(line: &str, rules: &Rules) -> Result<String, TrustError> {
    let trust = Trust::parse(line)?;
    let rules = rules.clone();
    let peers = trust.peers().iter().cloned();
    let peers = peers.map(|it| {
        let rules = rules.clone();
        format!("{}\n", Peer { rules, ..it })
    });
    let grants = trust.grants().iter().cloned();
    let grants = grants.map(|it| {
        let rules = rules.clone();
        format!("{}\n", Grant { rules, ..it })
    });
    Ok(peers.chain(grants).collect())
}

/// Removes the peer with this name from a trust file, or only one `key` of it; returns whether it
/// was there. A running node closes its session within two seconds.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or has only limits of a certificate
/// under this name.
pub fn revoke(path: &Path, name: &str, key: Option<PublicKey>) -> Result<bool, TrustError> {
    let of_key = |line: &str| {
        let word = line
            .split_whitespace()
            .nth(1)
            .and_then(|it| it.parse().ok());
        key.is_none_or(|key| word == Some(key))
    };
    let goes = |line: &&str| is_of(name, line) && of_key(line);
    change(path, |text| {
        Trust::parse(text)?;
        if !text.lines().any(|line| goes(&line)) {
            return Ok(None);
        }
        if text.lines().filter(goes).any(is_grant) {
            // Without its limits the certificate would be allowed more.
            return Err(TrustError::Certificate(name.to_owned()));
        }
        let rest = text.lines().filter(|line| !goes(line));
        Ok(Some(rest.flat_map(|line| [line, "\n"]).collect()))
    })
}

/// Whether a line limits a certificate.
fn is_grant(line: &str) -> bool {
    line.split_whitespace().nth(1) == Some(CERTIFICATE)
}

/// Whether a line is that of the peer with this name.
fn is_of(name: &str, line: &str) -> bool {
    line.split_whitespace().next() == Some(name)
}

/// Changes a trust file, while no other program does; returns whether `change` gave it another text.
fn change(
    path: &Path,
    change: impl FnOnce(&str) -> Result<Option<String>, TrustError>,
) -> Result<bool, TrustError> {
    let failed = |source| in_file(path, source);
    edit(path, Readers::Everyone, LONGEST, failed, |text| {
        let changed = change(text)?;
        changed.as_deref().map(Trust::parse).transpose()?;
        Ok(changed)
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

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
        trust(&path, &peer("rover", 1), false).unwrap();
        trust(&path, &peer("console", 2), false).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nrover "), "{text}");
        assert_eq!(
            Trust::parse(&text).unwrap().peers(),
            [peer("rover", 1), peer("console", 2)]
        );
        assert!(revoke(&path, "rover", None).unwrap());
        assert!(!revoke(&path, "rover", None).unwrap());
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nconsole "), "{text}");
    }

    #[test]
    fn changes_of_programs_at_once_are_all_made() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        trust(&path, &peer("stolen", 99), false).unwrap();
        std::thread::scope(|scope| {
            for octet in 0..20 {
                let path = &path;
                let name = format!("rover-{octet}");
                scope.spawn(move || trust(path, &peer(&name, octet), false).unwrap());
            }
            scope.spawn(|| assert!(revoke(&path, "stolen", None).unwrap()));
        });
        let text = fs::read_to_string(&path).unwrap();
        let names = Trust::parse(&text).unwrap();
        let names = names.peers().iter().map(|it| &it.name);
        assert_eq!(names.clone().count(), 20, "{text}");
        assert!(names.clone().all(|it| it != "stolen"), "{text}");
    }

    #[test]
    fn the_rules_of_a_peer_are_replaced_and_the_other_lines_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, "# our team\n").unwrap();
        trust(&path, &peer("rover", 1), false).unwrap();
        trust(&path, &peer("console", 2), false).unwrap();
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
        trust(&path, &peer("rover", 1), false).unwrap();
        let before = fs::read_to_string(&path).unwrap();
        for bad in [peer("rover", 2), peer("other", 1), peer("two words", 3)] {
            assert!(trust(&path, &bad, false).is_err(), "{bad:?}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), before);
    }

    #[test]
    fn a_name_gets_a_second_key_on_request_and_loses_the_first_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        let (old, new) = (peer("rover", 1), peer("rover", 2));
        trust(&path, &old, false).unwrap();
        let refused = trust(&path, &new, false).unwrap_err().to_string();
        assert!(refused.contains("--also"), "{refused}");
        trust(&path, &new, true).unwrap();
        assert!(!revoke(&path, "console", Some(old.key)).unwrap());
        assert!(revoke(&path, "rover", Some(old.key)).unwrap());
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(Trust::parse(&text).unwrap().peers(), [new]);
    }

    #[test]
    fn a_certificate_gets_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        let ids = vec!["60.1.255".parse().unwrap()];
        let console = Grant {
            name: "console".to_owned(),
            ids,
            rules: Rules::default(),
        };
        grant(&path, &console).unwrap();
        assert!(grant(&path, &console).is_err());
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text, "console certificate 60.1.255\n");
        assert_eq!(Trust::parse(&text).unwrap().grants(), [console]);
        let refused = revoke(&path, "console", None).unwrap_err().to_string();
        assert!(refused.contains("jaus keys ca revoke console"), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn planted_links_lead_no_change_to_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let [path, draft, victim] =
            ["trusted_keys", "trusted_keys.new", "victim"].map(|it| folder.path().join(it));
        fs::write(&victim, "precious").unwrap();
        std::os::unix::fs::symlink(&victim, draft).unwrap();
        trust(&path, &peer("rover", 1), false).unwrap();
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
        let linked = folder.path().join("linked");
        std::os::unix::fs::symlink(&path, &linked).unwrap();
        let refused = revoke(&linked, "rover", None).unwrap_err().to_string();
        assert!(refused.contains("symbolic link"), "{refused}");
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_root_revokes_is_revoked_for_the_service_too() {
        use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        for (name, octet) in [("rover", 1), ("operator", 2)] {
            trust(&path, &peer(name, octet), false).unwrap();
        }
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        if chown(&path, Some(65534), Some(65533)).is_err() {
            return eprintln!("SKIPPED: only root can give a file to another user");
        }
        assert!(revoke(&path, "operator", None).unwrap());
        let found = fs::metadata(&path).unwrap();
        let found = (found.uid(), found.gid(), found.mode() & 0o777);
        assert_eq!(found, (65534, 65533, 0o640));
    }
}
