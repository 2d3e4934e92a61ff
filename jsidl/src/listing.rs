//! Lists the definition files below a directory, in an order independent of the file system.

use std::fs;
use std::path::{Path, PathBuf};

use crate::compact;

/// Maximum depth of nested directories.
const DEEPEST: usize = 32;

/// The definition files below a directory.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    pub(crate) files: Vec<PathBuf>,
    /// Directories that could not be read, with the reason.
    pub(crate) unreadable: Vec<(PathBuf, String)>,
}

/// The `.xml`, `.csd` and `.cjsidl` files below a directory, in the order in which a [`Loader`](crate::Loader) reads
/// them.
///
/// # Errors
/// A sentence that names the first unreadable directory.
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
            self.skip(path, "directories are nested too deeply".into());
            return;
        }
        let entries = fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let mut entries = match entries {
            Ok(entries) => entries,
            Err(error) => {
                self.skip(path, format!("cannot read the directory: {error}"));
                return;
            }
        };
        entries.sort_by_key(fs::DirEntry::file_name);
        for entry in entries {
            let path = entry.path();
            // Links to directories are not followed: they may form a cycle.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                self.add(&path, depth + 1);
            } else if path.is_file()
                && (compact::has_extension(&path)
                    || path
                        .extension()
                        .is_some_and(|e| e.eq_ignore_ascii_case("xml")))
            {
                self.files.push(path);
            }
        }
    }

    fn skip(&mut self, path: &Path, reason: String) {
        self.unreadable.push((path.to_owned(), reason));
    }
}
