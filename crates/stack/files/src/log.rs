//! Files that grow: logs and recordings.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;

use crate::readers::Readers;

/// Options that open a file for writing. If they create it, these may read it; the mode of an existing
/// file stays as it is.
#[must_use]
pub fn options(readers: Readers) -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, readers.mode());
    #[cfg(not(unix))]
    let _ = readers.mode();
    options
}

/// Opens a log for appending, and creates it for its readers if it is not there.
///
/// # Errors
/// If it cannot be opened; [`io::ErrorKind::InvalidInput`] if it is a symbolic link or no regular file.
pub fn append(path: &Path, readers: Readers) -> io::Result<File> {
    open_or_create(path, readers, OpenOptions::new().append(true)).map(|(file, _)| file)
}

/// Opens a regular file, or creates it; returns whether it did. Two steps, so that a file of another user in a
/// sticky folder is opened too, which Linux refuses to an open that may create (`fs.protected_regular`).
pub(crate) fn open_or_create(
    path: &Path,
    readers: Readers,
    existing: &mut OpenOptions,
) -> io::Result<(File, bool)> {
    loop {
        if regular(path)?.is_none() {
            match options(readers).append(true).create_new(true).open(path) {
                // Another program was faster.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                created => return Ok((created?, true)),
            }
        }
        match open_regular(path, existing) {
            // Another program has removed it.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            opened => return Ok((opened?, false)),
        }
    }
}

/// Opens a regular file that is there. A link is not followed, and a pipe not waited for.
pub(crate) fn open_regular(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits();
        std::os::unix::fs::OpenOptionsExt::custom_flags(options, flags.cast_signed());
    }
    let file = options.open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(irregular()),
    }
}

/// The metadata of a regular file; `None` if it is not there.
pub(crate) fn regular(path: &Path) -> io::Result<Option<fs::Metadata>> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Ok(metadata) if metadata.is_symlink() => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is a symbolic link: name the file that it leads to",
        )),
        Ok(metadata) if !metadata.is_file() => Err(irregular()),
        found => found.map(Some),
    }
}

fn irregular() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file")
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::Write as _;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    fn mode_of(path: &Path) -> u32 {
        fs::metadata(path).map_or(0, |it| it.permissions().mode() & 0o777)
    }

    #[test]
    fn a_new_log_is_for_its_readers_and_the_mode_of_an_existing_one_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        append(&path, Readers::Owner)
            .unwrap()
            .write_all(b"one ")
            .unwrap();
        assert_eq!(mode_of(&path), 0o600);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o660)).unwrap();
        append(&path, Readers::Owner)
            .unwrap()
            .write_all(b"two")
            .unwrap();
        assert_eq!(mode_of(&path), 0o660);
        assert_eq!(fs::read_to_string(&path).unwrap(), "one two");
    }

    #[test]
    fn a_log_is_neither_a_link_nor_a_device_nor_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let [victim, link, dangling, pipe] =
            ["victim", "link", "dangling", "pipe"].map(|name| folder.path().join(name));
        fs::write(&victim, "precious").unwrap();
        symlink(&victim, &link).unwrap();
        symlink(folder.path().join("nothing"), &dangling).unwrap();
        let mode = rustix::fs::Mode::from_raw_mode(0o644);
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0).unwrap();
        let before = [Path::new("/dev/null"), &victim].map(mode_of);
        for path in [
            &link,
            &dangling,
            &pipe,
            Path::new("/dev/null"),
            folder.path(),
        ] {
            let error = append(path, Readers::Owner).unwrap_err();
            assert_eq!(
                error.kind(),
                io::ErrorKind::InvalidInput,
                "{path:?}: {error}"
            );
        }
        assert_eq!([Path::new("/dev/null"), &victim].map(mode_of), before);
        assert!(!folder.path().join("nothing").exists());
    }
}
