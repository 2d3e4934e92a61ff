//! The chain of a log: each line has the hash of the whole line before it.

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
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
    /// The number of the last whole line; 0 if there is none.
    pub(crate) number: u64,
    /// Its hash; zeros if there is none.
    pub(crate) hash: LineHash,
}

/// What a line has of the chain.
#[derive(Debug, Deserialize)]
pub(crate) struct Seal {
    /// Lines count from 1, across all files of the log.
    pub(crate) number: u64,
    /// The hash of the whole line before; zeros in the first.
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

/// A line with its end, and the end of the chain after it.
#[derive(Clone, Debug)]
pub(crate) struct SealedLine {
    pub(crate) text: String,
    pub(crate) end: ChainEnd,
}

impl SealedLine {
    /// The line with its hash, for a copy elsewhere, which then shows what the file has lost.
    pub(crate) fn copy(&self, file: &Path, is_written: bool) -> String {
        let (line, hash) = (self.text.trim_end_matches("}\n"), self.end.hash);
        let file = Value::from(file.to_string_lossy());
        let unwritten = if is_written {
            ""
        } else {
            r#","unwritten":true"#
        };
        format!(r#"{line},"hash":"{hash}","file":{file}{unwritten}}}"#)
    }
}

impl ChainEnd {
    /// The last whole line of this content; `None` if it has none. Of a torn line the chain has nothing.
    pub(crate) fn of(content: &[u8]) -> Option<Self> {
        let mut lines = content.rsplit(|&octet| octet == b'\n');
        lines.find_map(|line| {
            let (number, hash) = (Seal::of(line)?.number, LineHash::of(line));
            Some(Self { number, hash })
        })
    }

    /// The next line.
    pub(crate) fn seal(self, entry: &Entry) -> serde_json::Result<SealedLine> {
        let number = self.number + 1;
        let mut text = serde_json::to_string(&SealedEntry {
            entry,
            number,
            after: self.hash.to_string(),
        })?;
        let hash = LineHash::of(text.as_bytes());
        text.push('\n');
        let end = Self { number, hash };
        Ok(SealedLine { text, end })
    }
}
