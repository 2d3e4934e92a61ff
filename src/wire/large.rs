//! Joins the fragments of large messages, and detects where they hold the message code.
//!
//! AS5669A and Junior cut the message as it is, so only the first fragment begins with the message
//! code. JAUS++ repeats the code at the beginning of every fragment, and so do fragments read from
//! the older headers. A fragment does not say which of the two it is.

use bytes::{Bytes, BytesMut};

pub use super::ra::CODE_LEN;

/// Whether every fragment begins with the same code as the first.
#[must_use]
pub fn repeats_code<'a>(fragments: impl IntoIterator<Item = &'a Bytes>) -> bool {
    let mut fragments = fragments.into_iter();
    let code = fragments.next().and_then(|first| first.get(..CODE_LEN));
    code.is_some_and(|code| fragments.all(|fragment| fragment.starts_with(code)))
}

/// Joins the fragments, leaving out `skip` octets of each but the first.
#[must_use]
pub fn join<'a, I>(fragments: I, skip: usize) -> Bytes
where
    I: IntoIterator<Item = &'a Bytes>,
    I::IntoIter: Clone,
{
    let fragments = fragments.into_iter();
    let length = fragments.clone().map(Bytes::len).sum();
    let mut message = BytesMut::with_capacity(length);
    for (index, fragment) in fragments.enumerate() {
        let skip = if index == 0 { 0 } else { skip };
        message.extend_from_slice(fragment.get(skip..).unwrap_or_default());
    }
    message.freeze()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fragments<const N: usize>(octets: [&'static [u8]; N]) -> [Bytes; N] {
        octets.map(Bytes::from_static)
    }

    #[test]
    fn a_code_is_repeated_if_every_fragment_begins_with_that_of_the_first() {
        for (pieces, expected) in [
            (fragments([b"ab1", b"ab2", b"ab"]), true),
            (fragments([b"ab1", b"ab2", b"ac3"]), false),
            (fragments([b"ab1", b"ab2", b"a"]), false),
            (fragments([b"a", b"a", b"a"]), false),
        ] {
            assert_eq!(repeats_code(&pieces), expected, "{pieces:?}");
        }
        assert!(!repeats_code(&[]));
    }

    #[test]
    fn joining_leaves_out_the_repeated_octets_of_later_fragments() {
        let pieces = fragments([b"ab1", b"ab2", b"a"]);
        assert_eq!(join(&pieces, 0), "ab1ab2a");
        assert_eq!(join(&pieces, CODE_LEN), "ab12");
    }
}
