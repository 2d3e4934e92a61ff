//! Files of the workspace with the expected output of a test.

use std::fs;
use std::path::Path;

/// The environment variable with which tests rewrite their files instead of comparing them.
pub const RENEW: &str = "JAUS_RENEW_SNAPSHOTS";

/// Requires a file to contain this text. With [`RENEW`] set, writes the file first.
///
/// # Panics
/// If the file differs, with the first line that does.
#[track_caller]
pub fn check(path: &Path, text: &str) {
    if std::env::var_os(RENEW).is_some() {
        fs::write(path, text).unwrap();
    }
    let kept = fs::read_to_string(path).unwrap_or_default();
    if let Some((number, is, was)) = difference(text, &kept) {
        let path = path.display();
        panic!(
            "{path}:{number}: is now `{is}` instead of `{was}`; after a change that is meant, set \
             {RENEW}=1, run the test again and review the file"
        );
    }
}

/// The first difference: the line's number, and the line in each text.
fn difference<'t>(is: &'t str, was: &'t str) -> Option<(usize, &'t str, &'t str)> {
    let (mut is_lines, mut was_lines) = (is.split('\n'), was.split('\n'));
    (1..).find_map(|number| match (is_lines.next(), was_lines.next()) {
        (None, None) => Some(None),
        (is, was) if is == was => None,
        (is, was) => Some(Some((
            number,
            is.unwrap_or_default(),
            was.unwrap_or_default(),
        ))),
    })?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_different_line_is_named() {
        for (is, was, expected) in [
            ("a\nb\n", "a\nb\n", None),
            ("a\nb\n", "a\nc\n", Some((2, "b", "c"))),
            ("a\nb\n", "a\n", Some((2, "b", ""))),
            ("a\n", "a", Some((2, "", ""))),
            ("", "a", Some((1, "", "a"))),
        ] {
            assert_eq!(difference(is, was), expected, "{is:?} {was:?}");
        }
    }
}
