//! Putting the fragments of a whole message together: with their codes left out where they repeat
//! them, as JAUS++ does.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::peer::{JAUSPP_FRAGMENT, LargeStyle};
use crate::wire::{Version, large};

/// Joins the fragments of a whole message, whose sender may be known to cut in some style; tells
/// how it was cut.
///
/// Nothing in a fragment tells the style. JAUS++ is known by the length of its fragments, all of
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

/// Whether these are full fragments of JAUS++, by their length.
fn are_of_jauspp<'a>(mut pieces: impl Iterator<Item = &'a Bytes>) -> bool {
    pieces.all(|piece| piece.len() == JAUSPP_FRAGMENT)
}

/// Whether these may be all fragments of a message of JAUS++ that fills them, so that the last is
/// not marked.
pub(super) fn may_lack_the_mark(version: Version, pieces: &VecDeque<Bytes>) -> bool {
    version == Version::As5669a
        && pieces.len() > 1
        && are_of_jauspp(pieces.iter())
        && large::repeats_code(pieces)
}
