//! Compares output with a file of the repository.

use std::path::Path;
use std::{env, fs};

/// If set, [`check`] replaces each file that differs. Review the changes before you commit them.
pub const ACCEPT: &str = "JAUS_ACCEPT_SNAPSHOTS";

/// Requires that a file contains this text.
///
/// # Panics
/// If it differs; the panic names the first line that does.
#[track_caller]
pub fn check(file: impl AsRef<Path>, text: &str) {
    let file = file.as_ref();
    let expected = fs::read_to_string(file).unwrap_or_default();
    let Some(difference) = difference(&expected, text) else {
        return;
    };
    if env::var_os(ACCEPT).is_some() {
        return fs::write(file, text).unwrap();
    }
    let file = file.display();
    panic!("{file}: {difference}\nIf the output is right, run the test with {ACCEPT}=1.");
}

/// The first line that differs, with its number.
fn difference(expected: &str, text: &str) -> Option<String> {
    if expected == text {
        return None;
    }
    // Including the line ends, so that a missing one shows.
    let mut expected = expected.split_inclusive('\n');
    let mut lines = text.split_inclusive('\n');
    let (number, expected, is) = (1..)
        .map(|number| (number, expected.next(), lines.next()))
        .find(|(_, expected, is)| expected != is)?;
    let shown = |line: Option<&str>| line.map_or("no line".to_owned(), |line| format!("{line:?}"));
    let (expected, is) = (shown(expected), shown(is));
    Some(format!(
        "line {number}\n expected {expected}\n      got {is}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_that_differs_is_named() {
        assert_eq!(difference("a\nb\n", "a\nb\n"), None);
        for (expected, text, difference) in [
            (
                "a\nb\n",
                "a\nc\n",
                "line 2\n expected \"b\\n\"\n      got \"c\\n\"",
            ),
            (
                "a\n",
                "a\nb\n",
                "line 2\n expected no line\n      got \"b\\n\"",
            ),
            ("a\n", "a", "line 1\n expected \"a\\n\"\n      got \"a\""),
            ("", "a", "line 1\n expected no line\n      got \"a\""),
        ] {
            assert_eq!(super::difference(expected, text).unwrap(), difference);
        }
    }

    #[test]
    #[should_panic(expected = "JAUS_ACCEPT_SNAPSHOTS=1")]
    fn a_file_that_is_missing_fails_the_test() {
        assert!(
            env::var_os(ACCEPT).is_none(),
            "unset JAUS_ACCEPT_SNAPSHOTS=1"
        );
        check("no-such-folder/snapshot.txt", "text");
    }
}
