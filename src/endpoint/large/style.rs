//! Joins the fragments of a message, and removes the codes that JAUS++ repeats in each fragment.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::peer::{JAUSPP_FRAGMENT, LargeStyle};
use crate::wire::{Version, large};

/// Joins the fragments of a message; `known` is the sender's style, if known. Returns the style
/// found.
///
/// A fragment does not name its style. JAUS++ is recognised by the length of its fragments, all of
/// which begin with the same code.
pub(super) fn join(
    version: Version,
    pieces: &VecDeque<Bytes>,
    known: Option<LargeStyle>,
) -> (Bytes, LargeStyle) {
    let all_but_last = || pieces.iter().take(pieces.len().saturating_sub(1));
    let repeated = version == Version::As5669a
        && match known {
            Some(LargeStyle::Standard) => false,
            Some(LargeStyle::RepeatedCode) => large::repeats_code(pieces),
            None => are_of_jauspp(all_but_last()) && large::repeats_code(pieces),
        };
    let (skip, style) = if repeated {
        (large::CODE_LEN, LargeStyle::RepeatedCode)
    } else {
        (0, LargeStyle::Standard)
    };
    (large::join(pieces, skip), style)
}

/// Whether all pieces have the length of a full JAUS++ fragment.
fn are_of_jauspp<'a>(mut pieces: impl Iterator<Item = &'a Bytes>) -> bool {
    pieces.all(|piece| piece.len() == JAUSPP_FRAGMENT)
}

/// Whether these may be all the fragments of a JAUS++ message that fills them, so that the last is
/// not marked.
pub(super) fn may_lack_the_mark(version: Version, pieces: &VecDeque<Bytes>) -> bool {
    version == Version::As5669a
        && pieces.len() > 1
        && are_of_jauspp(pieces.iter())
        && large::repeats_code(pieces)
}
