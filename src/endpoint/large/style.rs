//! Where a large message's code stands: once, as the standard has it, or in each fragment, as
//! JAUS++ does.

use std::collections::{HashSet, VecDeque};

use bytes::Bytes;

use super::reassembly::Whole;
use crate::address::JausId;
use crate::endpoint::Config;
use crate::wire::{Version, large};

/// How large messages are cut for AS5669A, by the sender's habit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LargeStyle {
    /// The message is cut as it is; only the first fragment begins with its code. So do the
    /// standard and Junior.
    #[default]
    Standard,
    /// Each fragment begins with the message code. So does JAUS++, and it understands nothing else.
    RepeatedCode,
}

/// The payload of JAUS++'s fragments, but for the last: the code and 1571 octets.
const JAUSPP_FRAGMENT: usize = 1573;

/// Joins the fragments of a whole message, whose sender may be known to cut in some style.
///
/// Nothing in a fragment tells the style. JAUS++ is known by the length of its fragments, all of
/// which begin with the same code.
pub(super) fn join(version: Version, pieces: &VecDeque<Bytes>, known: Option<LargeStyle>) -> Whole {
    let of_jauspp = || {
        let all_but_last = pieces.iter().take(pieces.len().saturating_sub(1));
        all_but_last.map(Bytes::len).all(|n| n == JAUSPP_FRAGMENT)
    };
    let repeated = version == Version::As5669a
        && match known {
            Some(LargeStyle::Standard) => false,
            Some(LargeStyle::RepeatedCode) => large::repeats_code(pieces),
            None => of_jauspp() && large::repeats_code(pieces),
        };
    let (skip, style) = if repeated {
        (large::CODE_LEN, LargeStyle::RepeatedCode)
    } else {
        (0, LargeStyle::Standard)
    };
    Whole {
        payload: large::join(pieces, skip),
        style,
    }
}

/// Whose habits are known.
#[derive(Debug)]
pub(in crate::endpoint) struct LargeStyles {
    configured: Vec<(JausId, LargeStyle)>,
    /// Who repeats the code.
    learned: HashSet<JausId>,
    limit: usize,
}

impl LargeStyles {
    pub(in crate::endpoint) fn new(config: &Config) -> Self {
        Self {
            configured: config.large_styles.clone(),
            learned: HashSet::new(),
            limit: config.max_peers,
        }
    }

    /// The habit of a peer, if it is known.
    pub(in crate::endpoint) fn of(&self, peer: JausId) -> Option<LargeStyle> {
        let configured = self.configured.iter().find(|(id, _)| id.matches(peer));
        let learned = || {
            self.learned
                .contains(&peer)
                .then_some(LargeStyle::RepeatedCode)
        };
        configured.map(|&(_, style)| style).or_else(learned)
    }

    /// Takes note of how a peer has cut a message.
    pub(in crate::endpoint) fn learn(&mut self, peer: JausId, style: LargeStyle) {
        if style == LargeStyle::RepeatedCode && self.learned.len() < self.limit {
            self.learned.insert(peer);
        }
    }
}
