//! The chain of a log: each line has the hash of the line before it.

use std::fmt;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::entry::Entry;

/// The SHA-256 of a line, without its end. As text 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineHash([u8; 32]);

impl LineHash {
    pub(crate) fn of(line: &[u8]) -> Self {
        Self(Sha256::digest(line).into())
    }
}

impl fmt::Display for LineHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|octet| write!(f, "{octet:02x}"))
    }
}

/// The end of a chain, to which the next line is added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChainEnd {
    /// The number of the last complete line; 0 if there is none.
    pub(crate) number: u64,
    /// The hash of the last line; zeros if there is none.
    pub(crate) hash: LineHash,
}

/// What a line has of the chain.
#[derive(Debug, Deserialize)]
pub(crate) struct Seal {
    /// Lines count from 1, across all files of the log.
    pub(crate) number: u64,
    /// The hash of the line before; zeros in the first.
    pub(crate) after: String,
}

impl Seal {
    /// Reads the seal of a line; `None` if it is no line of a log.
    pub(crate) fn of(line: &[u8]) -> Option<Self> {
        serde_json::from_slice(line).ok()
    }
}

#[derive(Serialize)]
struct SealedEntry<'e> {
    #[serde(flatten)]
    entry: &'e Entry,
    number: u64,
    after: String,
}

impl ChainEnd {
    /// The end of a chain with these lines; `None` without lines. The last one may be incomplete.
    pub(crate) fn of(content: &[u8]) -> Option<Self> {
        let content = content.strip_suffix(b"\n").unwrap_or(content);
        let mut lines = content.rsplit(|&octet| octet == b'\n');
        let last = lines.next().filter(|it| !it.is_empty())?;
        let mut complete = std::iter::once(last).chain(lines).filter_map(Seal::of);
        Some(Self {
            number: complete.next().map_or(0, |seal| seal.number),
            hash: LineHash::of(last),
        })
    }

    /// The next line, with its end, and the end of the chain after it.
    pub(crate) fn seal(self, entry: &Entry) -> serde_json::Result<(Vec<u8>, Self)> {
        let number = self.number + 1;
        let mut line = serde_json::to_vec(&SealedEntry {
            entry,
            number,
            after: self.hash.to_string(),
        })?;
        let hash = LineHash::of(&line);
        line.push(b'\n');
        Ok((line, Self { number, hash }))
    }
}
