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

#[cfg(test)]
mod tests {
    use super::*;

    /// Fragments of these lengths, each of which begins with the same code.
    fn pieces(lengths: &[usize]) -> VecDeque<Bytes> {
        let piece = |&length: &usize| [&[0x01, 0x4B][..], &vec![7; length - 2]].concat().into();
        lengths.iter().map(piece).collect()
    }

    #[test]
    fn a_repeated_code_is_removed_from_peers_that_are_known_or_seen_to_repeat_it() {
        const FULL: usize = JAUSPP_FRAGMENT;
        let repeated = Some(LargeStyle::RepeatedCode);
        for (version, lengths, known, expected) in [
            (Version::As5669a, [FULL, FULL, 100], None, true),
            (Version::As5669a, [FULL, 100, 100], None, false),
            (Version::As5669a, [FULL, 100, 100], repeated, true),
            (
                Version::As5669a,
                [FULL, FULL, 100],
                Some(LargeStyle::Standard),
                false,
            ),
            (Version::As5669, [FULL, FULL, 100], repeated, false),
        ] {
            let (joined, style) = join(version, &pieces(&lengths), known);
            assert_eq!(style == LargeStyle::RepeatedCode, expected, "{lengths:?}");
            let removed = if expected { 4 } else { 0 };
            assert_eq!(joined.len(), lengths.iter().sum::<usize>() - removed);
        }
        let mut others = pieces(&[FULL, FULL]);
        others[1] = vec![9; FULL].into();
        let (_, style) = join(Version::As5669a, &others, repeated);
        assert_eq!(style, LargeStyle::Standard, "another code");
    }

    #[test]
    fn several_full_fragments_with_one_code_may_lack_the_mark() {
        const FULL: usize = JAUSPP_FRAGMENT;
        let (current, older) = (Version::As5669a, Version::As5669);
        for (version, lengths, expected) in [
            (current, &[FULL, FULL][..], true),
            (older, &[FULL, FULL], false),
            (current, &[FULL], false),
            (current, &[FULL, FULL - 1], false),
        ] {
            let lacks = may_lack_the_mark(version, &pieces(lengths));
            assert_eq!(lacks, expected, "{lengths:?}");
        }
        let mut others = pieces(&[FULL, FULL]);
        others[1] = vec![9; FULL].into();
        assert!(!may_lack_the_mark(current, &others), "another code");
    }
}
