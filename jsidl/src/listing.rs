//! The definitions of a directory and those below it, in an order that does not depend on the file
//! system.

use std::fs;
use std::path::{Path, PathBuf};

/// Directories within each other.
const DEEPEST: usize = 32;

/// The `.xml` files of a directory.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    pub(crate) files: Vec<PathBuf>,
    /// Directories that could not be read, and why.
    pub(crate) unreadable: Vec<(PathBuf, String)>,
}

/// The `.xml` files of a directory and those below it, as a [`Loader`](crate::Loader) reads them.
///
/// # Errors
/// A sentence with the first directory that cannot be read.
pub fn definition_files(directory: impl AsRef<Path>) -> Result<Vec<PathBuf>, String> {
    let listing = Listing::of(directory.as_ref());
    match listing.unreadable.into_iter().next() {
        Some((path, reason)) => Err(format!("{}: {reason}", path.display())),
        None => Ok(listing.files),
    }
}

impl Listing {
    pub(crate) fn of(directory: &Path) -> Self {
        let mut listing = Self::default();
        listing.add(directory, 0);
        listing
    }

    fn add(&mut self, path: &Path, depth: usize) {
        if depth > DEEPEST {
            self.skip(path, "directories are nested too deeply here".into());
            return;
        }
        let entries = fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let mut entries = match entries {
            Ok(entries) => entries,
            Err(error) => {
                self.skip(path, format!("the directory cannot be read: {error}"));
                return;
            }
        };
        entries.sort_by_key(fs::DirEntry::file_name);
        for entry in entries {
            let path = entry.path();
            // Links to directories are not followed: they may lead in a circle.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                self.add(&path, depth + 1);
            } else if path.is_file()
                && path
                    .extension()
                    .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
            {
                self.files.push(path);
            }
        }
    }

    fn skip(&mut self, path: &Path, reason: String) {
        self.unreadable.push((path.to_owned(), reason));
    }
}
