//! What is said of each departure, and the table of all of them.

use std::fmt;

use super::{Departure, Peer, Sign};

/// Where a departure is known from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// It was seen on the wire between running peers.
    Recorded,
    /// A running peer was made to do it.
    Provoked,
    /// It was read in the peer's code.
    Read,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Recorded => "recorded",
            Self::Provoked => "provoked",
            Self::Read => "read in its code",
        })
    }
}

/// How it is known that a peer departs in this way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recognition {
    /// By any of these.
    By(&'static [Sign]),
    /// It need not be known: what we do suits everybody.
    NeedNotBe,
    /// It cannot be seen: an [`Assignment`](super::Assignment) says so.
    Configured,
}

impl fmt::Display for Recognition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::By(signs) => {
                for (index, sign) in signs.iter().enumerate() {
                    let between = if index == 0 { "" } else { "; or " };
                    write!(f, "{between}{sign}")?;
                }
                Ok(())
            }
            Self::NeedNotBe => f.write_str("need not be: what we do suits everybody"),
            Self::Configured => f.write_str("must be configured: `[[profile]]`"),
        }
    }
}

/// What there is to know of a departure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Entry {
    /// Its name, in a few words.
    pub name: &'static str,
    /// Whose it is.
    pub peers: &'static [Peer],
    /// What they do.
    pub does: &'static str,
    /// Where we know it from.
    pub source: Source,
    /// How it is recognised.
    pub told: Recognition,
    /// What we do.
    pub ours: &'static str,
    /// The file that does it, from the root of the repository.
    pub place: &'static str,
    /// The test that fails if it is not done.
    pub test: &'static str,
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.entry().name)
    }
}

/// The table of all departures, as Markdown.
#[must_use]
pub fn table() -> impl fmt::Display {
    Table
}

struct Table;

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| departure | whose | known from | recognised | what we do | where, and the test |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|")?;
        for departure in Departure::ALL {
            let Entry {
                name,
                does,
                source,
                told,
                ours,
                place,
                test,
                peers,
            } = departure.entry();
            let peers: Vec<_> = peers.iter().map(|peer| peer.name()).collect();
            let peers = peers.join(", ");
            writeln!(
                f,
                "| **{name}**: {does} | {peers} | {source} | {told} | {ours} | `{place}`: `{test}` |"
            )?;
        }
        Ok(())
    }
}
