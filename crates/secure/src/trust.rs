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
//!
//! A name may have several keys, so that a key can be replaced. A node that uses certificates needs
//! no line for a peer; a line with the word `certificate` in place of the key narrows the ids of the
//! certificate with that name, and grants it rules.

mod file;

use std::fmt;
use std::io;
use std::path::PathBuf;
use std::str::FromStr;

use jaus::address::JausId;

use crate::approval::{ApprovalError, Approvers};
use crate::certificate::Certificate;
use crate::key::{KeyError, PublicKey};
use jaus::rights::{RuleError, Rules, Table};

pub use file::TrustFile;
pub(crate) use file::in_file;

/// What stands in place of the key in a line for a certificate.
pub(crate) const CERTIFICATE: &str = "certificate";
/// The longest trust file, in octets: some ten thousand keys.
pub(crate) const LONGEST: u64 = 1 << 20;

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
    /// The file has a malformed line.
    #[error("the trust file {}, {source}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The line, and what is wrong.
        source: Box<Self>,
    },
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
    /// What is to be revoked is a certificate, which the file only limits.
    #[error(
        "`{0}` is trusted by its certificate, and this line only limits it: revoke the certificate \
         with `jaus keys ca revoke {0}`"
    )]
    Certificate(String),
    /// A rule is malformed.
    #[error("line {line}: {source}")]
    Rule {
        /// The line's number, from 1.
        line: usize,
        /// The reason.
        source: RuleError,
    },
    /// The name has a key already.
    #[error(
        "`{0}` has a key already: add another one with `--also`, or remove the first with \
         `jaus keys revoke`"
    )]
    Known(String),
    /// The dual control of the file refuses something.
    #[error(transparent)]
    Approval(#[from] ApprovalError),
    /// A key appears twice, or a name in lines for certificates.
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
        match parse_line(1, text)? {
            Line::Peer(peer) => Ok(peer),
            Line::Grant(_) => Err(TrustError::Key {
                line: 1,
                source: KeyError::Text(CERTIFICATE.to_owned()),
            }),
        }
    }
}

/// What a trust file grants to the certificate with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grant {
    /// The name in the certificate.
    pub name: String,
    /// The ids that it may speak for, of those in the certificate; with wildcards.
    pub ids: Vec<JausId>,
    /// What it may do.
    pub rules: Rules,
}

/// The trusted peers of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trust {
    peers: Vec<Peer>,
    grants: Vec<Grant>,
    /// Who has approved its lines, under dual control.
    pub(crate) approvers: Option<Approvers>,
}

impl Trust {
    /// Trusts these peers.
    #[must_use]
    pub const fn new(peers: Vec<Peer>) -> Self {
        Self {
            peers,
            grants: Vec::new(),
            approvers: None,
        }
    }

    /// Reads the text of a trust file.
    ///
    /// # Errors
    /// The first line that is malformed.
    pub fn parse(text: &str) -> Result<Self, TrustError> {
        let mut lines: Vec<(usize, Line)> = Vec::new();
        for (index, text) in text.lines().enumerate() {
            let number = index + 1;
            let text = text.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            let line = parse_line(number, text)?;
            if let Some(&(first, _)) = lines.iter().find(|(_, it)| it.repeats(&line)) {
                let (line, name) = (number, line.name().to_owned());
                return Err(TrustError::Twice { line, first, name });
            }
            lines.push((number, line));
        }
        let mut trust = Self::default();
        for (_, line) in lines {
            match line {
                Line::Peer(peer) => trust.peers.push(peer),
                Line::Grant(grant) => trust.grants.push(grant),
            }
        }
        Ok(trust)
    }

    /// Checks the names in the rules of all lines against the definitions in use: see [`Rules::verify`].
    ///
    /// # Errors
    /// The name of the first line that is wrong, and why.
    pub fn verify(&self, table: &Table) -> Result<(), (String, RuleError)> {
        let peers = self.peers.iter().map(|it| (&it.name, &it.rules));
        let grants = self.grants.iter().map(|it| (&it.name, &it.rules));
        peers.chain(grants).try_for_each(|(name, rules)| {
            let verified = rules.verify(table);
            verified.map_err(|error| (name.clone(), error))
        })
    }

    /// Whether an id is rather that of another trusted key than of this peer: of several keys that may use it, it
    /// belongs to those with the narrowest ids.
    #[must_use]
    pub fn is_others(&self, peer: &Peer, id: JausId) -> bool {
        let narrowest = |of: &Peer| {
            let ids = of.ids.iter().filter(|ids| ids.matches(id));
            ids.map(|ids| wildcards(*ids)).min()
        };
        let others = self.peers.iter().filter(|it| it.key != peer.key);
        let others = others.filter_map(narrowest).min();
        matches!((narrowest(peer), others), (Some(own), Some(others)) if others < own)
    }

    /// The other peers, by their names, that may use ids of this one.
    pub fn sharing<'t>(&'t self, peer: &'t Peer) -> impl Iterator<Item = &'t Peer> {
        let others = self.peers.iter().filter(|it| it.name != peer.name);
        others.filter(|it| !common(&it.ids, &peer.ids).is_empty())
    }

    /// The peer with this key.
    #[must_use]
    pub fn find(&self, key: PublicKey) -> Option<&Peer> {
        self.peers.iter().find(|peer| peer.key == key)
    }

    /// The peer with this certificate, which has been verified.
    #[must_use]
    pub fn certified(&self, certificate: &Certificate) -> Peer {
        let grant = self.grants.iter().find(|it| it.name == certificate.name());
        let ids = certificate.ids();
        Peer {
            name: certificate.name().to_owned(),
            key: certificate.key(),
            ids: grant.map_or_else(|| ids.to_vec(), |it| common(ids, &it.ids)),
            rules: grant.map_or_else(Rules::default, |it| it.rules.clone()),
        }
    }

    /// The name and the text of each line.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (&str, String)> {
        let peers = self.peers.iter().map(|it| (&*it.name, it.to_string()));
        let grants = self.grants.iter().map(|it| (&*it.name, it.to_string()));
        peers.chain(grants)
    }

    /// The peers that are trusted by their keys, in the order of the file.
    #[must_use]
    pub fn peers(&self) -> &[Peer] {
        &self.peers
    }

    /// What is granted to certificates, in the order of the file.
    #[must_use]
    pub fn grants(&self) -> &[Grant] {
        &self.grants
    }
}

/// How many fields of ids are wildcards.
fn wildcards(ids: JausId) -> usize {
    let fields = [
        ids.subsystem() == JausId::ANY_SUBSYSTEM,
        ids.node() == JausId::ANY_NODE,
        ids.component() == JausId::ANY_COMPONENT,
    ];
    fields.into_iter().filter(|is_any| *is_any).count()
}

/// The ids that match an id of both lists.
fn common(some: &[JausId], others: &[JausId]) -> Vec<JausId> {
    let pairs = some
        .iter()
        .flat_map(|one| others.iter().map(move |other| (*one, *other)));
    pairs
        .filter_map(|(one, other)| one.intersection(other))
        .collect()
}

/// A line of a trust file.
enum Line {
    Peer(Peer),
    Grant(Grant),
}

impl Line {
    fn name(&self) -> &str {
        match self {
            Self::Peer(Peer { name, .. }) | Self::Grant(Grant { name, .. }) => name,
        }
    }

    /// Whether both are about the same key or certificate.
    fn repeats(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Peer(one), Self::Peer(other)) => one.key == other.key,
            (Self::Grant(one), Self::Grant(other)) => one.name == other.name,
            _ => false,
        }
    }
}

fn parse_line(line: usize, text: &str) -> Result<Line, TrustError> {
    let mut words = text.split_whitespace();
    let (Some(name), Some(key), Some(ids)) = (words.next(), words.next(), words.next()) else {
        return Err(TrustError::Parts { line });
    };
    let name = name.to_owned();
    let key = match key {
        CERTIFICATE => None,
        key => Some(
            key.parse()
                .map_err(|source| TrustError::Key { line, source })?,
        ),
    };
    let ids = ids.split(',').map(|text| {
        text.parse().map_err(|_| TrustError::Id {
            line,
            text: text.chars().take(60).collect(),
        })
    });
    let ids = ids.collect::<Result<_, _>>()?;
    let rules = Rules::parse(words).map_err(|source| TrustError::Rule { line, source })?;
    Ok(match key {
        Some(key) => Line::Peer(Peer {
            name,
            key,
            ids,
            rules,
        }),
        None => Line::Grant(Grant { name, ids, rules }),
    })
}

/// Its line in a trust file.
impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&line(
            &self.name,
            &self.key.to_string(),
            &self.ids,
            &self.rules,
        ))
    }
}

/// Its line in a trust file.
impl fmt::Display for Grant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&line(&self.name, CERTIFICATE, &self.ids, &self.rules))
    }
}

fn line(name: &str, key: &str, ids: &[JausId], rules: &Rules) -> String {
    let ids: Vec<_> = ids.iter().map(JausId::to_string).collect();
    let line = format!("{name} {key} {} {rules}", ids.join(","));
    line.trim_end().to_owned()
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
}
