//! Changes of a text that people and programs edit.

use std::io;
use std::path::Path;

use crate::draft::replace;
use crate::lock::FileLock;
use crate::readers::{Owners, Readers, read_text_from};

/// Changes the text of a file while no other program does; a missing file is an empty text. `change`
/// returns the new text, or `None` to leave the file. Returns whether the file was replaced. Root may change the
/// file of any user, who keeps it.
///
/// # Errors
/// Those of `change`, and those of [`FileLock::of`], [`read_text`](crate::read_text) but for the owner, and
/// [`replace`], through `failed`.
pub fn edit<E>(
    path: &Path,
    readers: Readers,
    longest: u64,
    failed: impl Fn(io::Error) -> E,
    change: impl FnOnce(&str) -> Result<Option<String>, E>,
) -> Result<bool, E> {
    let _alone = FileLock::of(path).map_err(&failed)?;
    let text = match read_text_from(path, readers, longest, Owners::Any) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
        text => text.map_err(&failed)?,
    };
    let Some(changed) = change(&text)? else {
        return Ok(false);
    };
    replace(path, readers, changed.as_bytes()).map_err(failed)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn parallel_edits_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::thread::scope(|scope| {
            for number in 0..20 {
                let path = &path;
                scope.spawn(move || {
                    let add = |text: &str| Ok(Some(format!("{text}{number}\n")));
                    edit(path, Readers::Owner, 1000, |error| error, add).unwrap()
                });
            }
        });
        assert_eq!(fs::read_to_string(&path).unwrap().lines().count(), 20);
    }

    #[test]
    fn a_change_that_fails_leaves_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "before").unwrap();
        let fails = |_: &str| Err(io::Error::other("no"));
        edit(&path, Readers::Everyone, 100, |error| error, fails).unwrap_err();
        assert!(!edit(&path, Readers::Everyone, 100, |error| error, |_| Ok(None)).unwrap());
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
    }
}
