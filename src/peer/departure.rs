//! The description of each departure, and the table of all of them.

use std::fmt;

use super::{Departure, Peer, Sign};

/// How a departure is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// It was recorded on the wire between running peers.
    Recorded,
    /// It was provoked in a running peer.
    Provoked,
    /// It was read in the peer's code.
    Read,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Recorded => "recorded",
            Self::Provoked => "provoked",
            Self::Read => "read in its source",
        })
    }
}

/// How a peer with this departure is recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recognition {
    /// By any of these signs.
    By(&'static [Sign]),
    /// It need not be recognised: the same handling suits every peer.
    NeedNotBe,
    /// It cannot be observed, and needs an [`Assignment`](super::Assignment).
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
            Self::NeedNotBe => f.write_str("not needed: our handling suits every peer"),
            Self::Configured => f.write_str("must be configured: `[[profile]]`"),
        }
    }
}

/// The description of a departure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Entry {
    /// A short name.
    pub name: &'static str,
    /// The peers that it applies to.
    pub peers: &'static [Peer],
    /// What these peers do.
    pub does: &'static str,
    /// How it is known.
    pub source: Source,
    /// How it is recognised.
    pub told: Recognition,
    /// How this implementation handles it.
    pub ours: &'static str,
    /// The file that handles it, relative to the root of the repository.
    pub place: &'static str,
    /// The test that covers it.
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
            "| departure | peers | known from | recognised by | our handling | file and test |"
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
