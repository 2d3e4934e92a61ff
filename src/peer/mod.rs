//! Profiles of known peers: where each departs from the standard, how that is recognised, and what
//! this implementation does about it.
//!
//! Every [`Departure`] that this implementation handles has a name. It says which peers it applies
//! to, how it is known, how it is recognised or that it must be [configured](Assignment), how it is
//! handled, where in the code, and which test covers it. The table of all of them is
//! [below](#the-table), for programs in [`DEPARTURES`].
//!
//! Most handling suits every peer and applies to all: tolerance for lenient peers never degrades
//! what strict peers get. Handling that would not suit every peer depends on the
//! [`Implementation`] that was recognised or configured, through methods such as
//! [`Implementation::large_style`], [`Implementation::payload_limit`], [`Implementation::intake`],
//! [`Implementation::reads_zero_as_wildcard`] and [`Implementation::is_deaf_on_its_connections`].
//!
//! A [`Recogniser`] receives everything that one peer sends, and reports which peer it is, with
//! what certainty, and why. It does no I/O and keeps a few octets of state.
//!
//! ```
//! use bytes::Bytes;
//! use jaus::peer::{Certainty, Implementation, Recogniser};
//! use jaus::wire::judp;
//!
//! // Recorded from JAUS++, which reports its services and then sends a query from the same buffer.
//! let query = b"\x02\x00\x11\x00\x01\x01\x01\x4D\x00\x07\x01\xE8\x03\x01\x2B\x02\x02\x00urn:jaus";
//! let mut recogniser = Recogniser::default();
//! let mut frames = judp::frames(Bytes::from_static(query))?;
//! let frame = frames.next().expect("a first message or an error")?;
//! recogniser.handle_frame(&frame, frames.remaining());
//! let verdict = recogniser.verdict();
//! assert_eq!((verdict.peer, verdict.certainty), (Implementation::JausPlusPlus, Certainty::Likely));
//! assert!(verdict.reasons[0].explanation().contains("follow its messages"));
//! # Ok::<(), jaus::wire::Error>(())
//! ```
//!
//! # The table
//!
#![doc = include_str!("departures.md")]

mod departure;
mod habits;
mod numbers;
mod recogniser;
mod sign;
#[cfg(test)]
mod tests;

use std::fmt;
use std::str::FromStr;

use crate::address::JausId;
use crate::as_text::serde_as_text;

pub use departure::{DEPARTURES, Departure, Recognition, Source};
pub(crate) use habits::JAUSPP_FRAGMENT;
pub use habits::{LargeStyle, Pacing};
pub(crate) use recogniser::is_priority_fault;
pub use recogniser::{Certainty, Recogniser, Verdict};
pub use sign::Sign;

/// A JAUS implementation whose departures are known. Settings name it `standard`, `jaus++`,
/// `junior`, `jts`, `fkie`, `openjaus-sdk` or `iop`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Implementation {
    /// A peer without known departures, treated as the standard says.
    #[default]
    Standard,
    /// JAUS++ (ACTIVE laboratory).
    JausPlusPlus,
    /// Junior, the middleware of its own repository ("JR").
    Junior,
    /// Junior as copied into the JAUS Tool Set, and the code generated with it.
    Jts,
    /// Junior as copied into fkie's IOP packages for ROS.
    Fkie,
    /// A commercial OpenJAUS SDK that speaks AS5669A; the competitions' judging tool is built on
    /// one.
    OpenJausSdk,
    /// A system of the interoperability profiles (IOP, AEODRS), where an id's 0 stands for "all".
    Iop,
}

impl Implementation {
    /// All peers.
    pub const ALL: [Self; 7] = [
        Self::Standard,
        Self::JausPlusPlus,
        Self::Junior,
        Self::Jts,
        Self::Fkie,
        Self::OpenJausSdk,
        Self::Iop,
    ];

    /// Its name in settings: `standard`, `jaus++`, `junior`, `jts`, `fkie`, `openjaus-sdk`, `iop`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::JausPlusPlus => "jaus++",
            Self::Junior => "junior",
            Self::Jts => "jts",
            Self::Fkie => "fkie",
            Self::OpenJausSdk => "openjaus-sdk",
            Self::Iop => "iop",
        }
    }

    /// Its display name.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Standard => "a peer that keeps to the standard",
            Self::JausPlusPlus => "JAUS++",
            Self::Junior => "Junior",
            Self::Jts => "Junior of the JAUS Tool Set",
            Self::Fkie => "Junior of fkie's IOP packages",
            Self::OpenJausSdk => "OpenJAUS SDK (AS5669A)",
            Self::Iop => "IOP or AEODRS",
        }
    }

    /// The implementation that it is a fork of, whose signs it also shows.
    pub(crate) const fn fork_of(self) -> Option<Self> {
        match self {
            Self::Jts | Self::Fkie => Some(Self::Junior),
            _ => None,
        }
    }

    /// Its departures from the standard.
    pub fn departures(self) -> impl Iterator<Item = &'static Departure> {
        let of_it = move |departure: &&Departure| departure.peers.contains(&self);
        DEPARTURES.iter().filter(of_it)
    }
}

impl fmt::Display for Implementation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The text is not the name of a peer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no profile `{0}`: choose \"standard\", \"jaus++\", \"junior\", \"jts\", \"fkie\", \
     \"openjaus-sdk\" or \"iop\""
)]
pub struct UnknownPeer(pub String);

impl FromStr for Implementation {
    type Err = UnknownPeer;

    fn from_str(text: &str) -> Result<Self, UnknownPeer> {
        let named = Self::ALL.into_iter().find(|peer| peer.name() == text);
        named.ok_or_else(|| UnknownPeer(text.to_owned()))
    }
}

serde_as_text!(Implementation);

/// Assigns a profile to an id. It takes precedence over the recognition of the peer.
///
/// ```toml
/// [[profile]]
/// id = "7.255.255"        # every component of subsystem 7
/// profile = "jaus++"
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Assignment {
    /// The id, which may hold the wildcards 65535 and 255.
    pub id: JausId,
    /// The profile. `standard` prevents the peer from being recognised as anything else.
    pub profile: Implementation,
}

impl Assignment {
    /// The profile of an id: the first entry that matches.
    #[must_use]
    pub fn find(all: &[Self], id: JausId) -> Option<Implementation> {
        let fits = |assignment: &&Self| assignment.id.matches(id);
        all.iter().find(fits).map(|assignment| assignment.profile)
    }
}
