//! The keys that a node trusts, the ids that each of them may speak for, and what it may do.
//!
//! A trust file has a line for each key: a name for people, the public key, the ids, separated by
//! commas, and its [rules](Rules). `255` and `65535` are wildcards as in JAUS addresses. A key
//! without rules may observe.
//!
//! ```text
//! # name     public key                                    speaks for         may
//! rover      WkE5vXW4lFyQ3nDzGnUlnQ0Xs0mB5bqkVHk0pJ1Yd2s=  101.255.255
//! console    0b2yKQZ0C3r1mHqkqfM3d5bq0f5fY1b5o8hGxqj9n3E=  60.1.255,60.2.255  control=127
//! ```

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, PoisonError, RwLock, Weak};
use std::time::{Duration, SystemTime};

use jaus::address::JausId;

use crate::key::{KeyError, PublicKey};
use crate::rules::{RuleError, Rules};

/// How often a running node looks whether its trust file has changed.
const FOLLOW_INTERVAL: Duration = Duration::from_secs(1);
/// The longest trust file, in octets: some ten thousand keys.
const LONGEST: u64 = 1 << 20;

/// Why a trust file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrustError {
    /// The file cannot be read.
    #[error("the trust file {}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is longer than 1 MiB.
    #[error("the trust file {} is longer than 1 MiB", .0.display())]
    TooLong(PathBuf),
    /// A line lacks a part.
    #[error("line {line}: write a name, a public key and the ids, such as `rover KEY 101.255.255`")]
    Parts {
        /// Its number, from 1.
        line: usize,
    },
    /// A key is malformed.
    #[error("line {line}: {source}")]
    Key {
        /// The line's number, from 1.
        line: usize,
        /// The reason.
        source: KeyError,
    },
    /// An id is malformed.
    #[error("line {line}: `{text}` is not an id such as 101.1.33, or 101.255.255 for all of 101")]
    Id {
        /// The line's number, from 1.
        line: usize,
        /// The text.
        text: String,
    },
    /// A rule is malformed.
    #[error("line {line}: {source}")]
    Rule {
        /// The line's number, from 1.
        line: usize,
        /// The reason.
        source: RuleError,
    },
    /// A key or name appears twice.
    #[error("line {line}: `{name}` or its key is already in line {first}: remove one of them")]
    Twice {
        /// The line's number, from 1.
        line: usize,
        /// The number of the first line.
        first: usize,
        /// The name.
        name: String,
    },
}

/// A trusted peer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// Its name, for people.
    pub name: String,
    /// Its public key.
    pub key: PublicKey,
    /// The ids that it may speak for; with wildcards.
    pub ids: Vec<JausId>,
    /// What it may do.
    pub rules: Rules,
}

impl Peer {
    /// Whether it may send messages from this id.
    #[must_use]
    pub fn speaks_for(&self, source: JausId) -> bool {
        source.is_unicast() && self.ids.iter().any(|ids| ids.matches(source))
    }
}

/// Reads one line of a trust file.
impl FromStr for Peer {
    type Err = TrustError;

    fn from_str(text: &str) -> Result<Self, TrustError> {
        parse_line(1, text)
    }
}

/// The trusted peers of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trust(Vec<Peer>);

impl Trust {
    /// Trusts these peers.
    #[must_use]
    pub const fn new(peers: Vec<Peer>) -> Self {
        Self(peers)
    }

    /// Reads the text of a trust file.
    ///
    /// # Errors
    /// The first line that is malformed.
    pub fn parse(text: &str) -> Result<Self, TrustError> {
        let mut peers: Vec<(usize, Peer)> = Vec::new();
        for (index, text) in text.lines().enumerate() {
            let line = index + 1;
            let text = text.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            let peer = parse_line(line, text)?;
            let same = |(_, it): &&(usize, Peer)| it.key == peer.key || it.name == peer.name;
            if let Some(&(first, _)) = peers.iter().find(same) {
                let name = peer.name;
                return Err(TrustError::Twice { line, first, name });
            }
            peers.push((line, peer));
        }
        Ok(Self(peers.into_iter().map(|(_, peer)| peer).collect()))
    }

    /// The peer with this key.
    #[must_use]
    pub fn find(&self, key: PublicKey) -> Option<&Peer> {
        self.0.iter().find(|peer| peer.key == key)
    }

    /// All peers, in the order of the file.
    #[must_use]
    pub fn peers(&self) -> &[Peer] {
        &self.0
    }
}

fn parse_line(line: usize, text: &str) -> Result<Peer, TrustError> {
    let mut words = text.split_whitespace();
    let (Some(name), Some(key), Some(ids)) = (words.next(), words.next(), words.next()) else {
        return Err(TrustError::Parts { line });
    };
    let key = key
        .parse()
        .map_err(|source| TrustError::Key { line, source })?;
    let ids = ids.split(',').map(|text| {
        text.parse().map_err(|_| TrustError::Id {
            line,
            text: text.chars().take(60).collect(),
        })
    });
    let rules = Rules::parse(words).map_err(|source| TrustError::Rule { line, source })?;
    Ok(Peer {
        name: name.to_owned(),
        key,
        ids: ids.collect::<Result<_, _>>()?,
        rules,
    })
}

/// The line of a peer in a trust file.
pub(crate) fn line_of(peer: &Peer) -> String {
    let ids: Vec<_> = peer.ids.iter().map(JausId::to_string).collect();
    let line = format!(
        "{} {} {} {}",
        peer.name,
        peer.key,
        ids.join(","),
        peer.rules
    );
    format!("{}\n", line.trim_end())
}

/// The trust of a running node, shared by its link and its handshakes. Replacing it takes effect at
/// once: the link closes the sessions of keys that are no longer trusted.
#[derive(Clone, Debug, Default)]
pub struct TrustFile {
    trust: Shared,
    path: Option<PathBuf>,
}

/// The trust, and how often it was replaced.
type Shared = Arc<RwLock<(u64, Trust)>>;

impl TrustFile {
    /// Shares a trust that is not in a file.
    #[must_use]
    pub fn of(trust: Trust) -> Self {
        Self {
            trust: Arc::new(RwLock::new((0, trust))),
            path: None,
        }
    }

    /// Reads a trust file.
    ///
    /// # Errors
    /// If it cannot be read, or a line is malformed.
    pub fn load(path: &Path) -> Result<Self, TrustError> {
        Ok(Self {
            path: Some(path.to_owned()),
            ..Self::of(read(path)?)
        })
    }

    /// Reads the file again. On an error the previous trust stays in force.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn reload(&self) -> Result<(), TrustError> {
        if let Some(path) = &self.path {
            self.replace(read(path)?);
        }
        Ok(())
    }

    /// Reads the file again whenever it has changed, as long as the trust is in use. Must be called
    /// within a tokio runtime. A file that has become unusable changes nothing, and is logged.
    #[expect(
        clippy::disallowed_methods,
        reason = "the task only looks at a file, and ends with the trust"
    )]
    pub fn follow(&self) {
        if let Some(path) = &self.path {
            tokio::spawn(follow(Arc::downgrade(&self.trust), path.clone()));
        }
    }

    /// Replaces the trust.
    pub fn replace(&self, trust: Trust) {
        let mut inner = self.trust.write().unwrap_or_else(PoisonError::into_inner);
        *inner = (inner.0 + 1, trust);
    }

    /// The peer with this key.
    #[must_use]
    pub fn find(&self, key: PublicKey) -> Option<Peer> {
        let inner = self.trust.read().unwrap_or_else(PoisonError::into_inner);
        inner.1.find(key).cloned()
    }

    /// The number of trusted keys.
    #[must_use]
    pub fn len(&self) -> usize {
        let inner = self.trust.read().unwrap_or_else(PoisonError::into_inner);
        inner.1.peers().len()
    }

    /// Whether no key is trusted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All trusted keys.
    pub(crate) fn keys(&self) -> Vec<PublicKey> {
        let inner = self.trust.read().unwrap_or_else(PoisonError::into_inner);
        inner.1.peers().iter().map(|peer| peer.key).collect()
    }

    /// How often the trust was replaced.
    pub(crate) fn edition(&self) -> u64 {
        let inner = self.trust.read().unwrap_or_else(PoisonError::into_inner);
        inner.0
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "looks at a file in real time, also while a test pauses the clock"
)]
async fn follow(trust: Weak<RwLock<(u64, Trust)>>, path: PathBuf) {
    let mut seen = modified(&path);
    loop {
        tokio::time::sleep(FOLLOW_INTERVAL).await;
        let Some(trust) = trust.upgrade() else {
            return;
        };
        let now = modified(&path);
        if now == seen {
            continue;
        }
        seen = now;
        let file = TrustFile {
            trust,
            path: Some(path.clone()),
        };
        match file.reload() {
            Ok(()) => tracing::info!(path = %path.display(), "trust file read again"),
            Err(error) => tracing::error!(%error, "the previous trust stays in force"),
        }
    }
}

/// When the file was changed last; `None` if it is not there.
fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|it| it.modified()).ok()
}

fn read(path: &Path) -> Result<Trust, TrustError> {
    let in_file = |source| TrustError::File {
        path: path.to_owned(),
        source,
    };
    if fs::metadata(path).map_err(in_file)?.len() > LONGEST {
        return Err(TrustError::TooLong(path.to_owned()));
    }
    Trust::parse(&fs::read_to_string(path).map_err(in_file)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(octet: u8) -> PublicKey {
        PublicKey::from_octets([octet; 32])
    }

    #[test]
    fn each_line_names_a_peer_its_key_and_its_ids() {
        let text = format!(
            "# keys of the team\n\nrover {} 101.255.255\nconsole\t{} 60.1.1,60.2.255 # desktop\n",
            key(1),
            key(2)
        );
        let trust = Trust::parse(&text).unwrap();
        let rover = trust.find(key(1)).unwrap();
        assert_eq!(rover.name, "rover");
        assert!(rover.speaks_for(JausId::new(101, 1, 33)));
        assert!(!rover.speaks_for(JausId::new(102, 1, 33)));
        let console = trust.find(key(2)).unwrap();
        assert!(console.speaks_for(JausId::new(60, 1, 1)));
        assert!(console.speaks_for(JausId::new(60, 2, 9)));
        assert!(!console.speaks_for(JausId::new(60, 1, 2)));
        assert_eq!(trust.find(key(3)), None);
    }

    #[test]
    fn no_key_speaks_for_wildcards() {
        let trust = Trust::parse(&format!("all {} 65535.255.255", key(1))).unwrap();
        let peer = trust.find(key(1)).unwrap();
        assert!(peer.speaks_for(JausId::new(9, 9, 9)));
        for id in [
            JausId::EVERYONE,
            JausId::new(9, 255, 255),
            JausId::new(0, 0, 0),
        ] {
            assert!(!peer.speaks_for(id), "{id}");
        }
    }

    #[test]
    fn a_malformed_line_is_named_with_the_remedy() {
        for (text, words) in [
            ("rover".to_owned(), "line 1: write a name"),
            (format!("\nrover {}", key(1)), "line 2: write a name"),
            ("rover key 101.1.1".to_owned(), "`key` is not a public key"),
            (format!("rover {} 101.1", key(1)), "`101.1` is not an id"),
            (format!("rover {} 101.1.1,", key(1)), "`` is not an id"),
            (
                format!("rover {} 101.1.1\ndouble {} 102.1.1", key(1), key(1)),
                "line 2: `double` or its key is already in line 1",
            ),
        ] {
            let error = Trust::parse(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_reload_with_an_error_leaves_the_trust_in_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trusted_keys");
        fs::write(&path, format!("rover {} 101.255.255\n", key(1))).unwrap();
        let file = TrustFile::load(&path).unwrap();
        fs::write(&path, "rover\n").unwrap();
        assert!(file.reload().is_err());
        assert!(file.find(key(1)).is_some());
        fs::write(&path, "").unwrap();
        file.reload().unwrap();
        assert!(file.find(key(1)).is_none());
    }
}
