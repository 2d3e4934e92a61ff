//! A node's Unix socket: directory and socket with their permissions, and stale sockets.
//!
//! The socket is in a directory that only its owner can write to, and is accessible to the owner
//! alone. In addition the operating system reports the user of each connecting process. A
//! connection attempt distinguishes the socket of a living node from one that a crashed node has
//! left behind.

use std::fs::{self, DirBuilder, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use tokio::net::{UnixListener, UnixStream};

use super::Error;
use super::stream::{Stream, pid_of, unix_stream};
use super::usual_place::{directory, own_uid, path};

/// A Unix socket that is removed when the node ends.
#[derive(Debug)]
pub(crate) struct UnixSocket {
    listener: UnixListener,
    path: PathBuf,
    /// Device and inode of the socket's file: another one may have replaced it.
    file: (u64, u64),
    owner: u32,
}

impl UnixSocket {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let owner = own_uid();
        check_directory(parent(path), owner, 0o022)?;
        let listener = bind(path)?;
        let doing = || format!("setting the rights of {}", path.display());
        let rights = Permissions::from_mode(0o600);
        fs::set_permissions(path, rights).map_err(Error::io(doing()))?;
        let metadata = fs::symlink_metadata(path).map_err(Error::io(doing()))?;
        Ok(Self {
            listener,
            path: path.to_owned(),
            file: (metadata.dev(), metadata.ino()),
            owner,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) async fn accept(&self) -> Result<Stream, Error> {
        let accepted = self.listener.accept().await;
        let stream = accepted.and_then(|(stream, _)| unix_stream(stream));
        let (stream, uid) = stream.map_err(Error::io("accepting a component"))?;
        if !may_attach(uid, self.owner) {
            return Err(Error::Foreign {
                place: self.path.display().to_string(),
                uid,
                own: self.owner,
            });
        }
        Ok(stream)
    }
}

impl Drop for UnixSocket {
    fn drop(&mut self) {
        let is_ours = |file: Metadata| (file.dev(), file.ino()) == self.file;
        if fs::symlink_metadata(&self.path).is_ok_and(is_ours) {
            // The next node recognises a remaining file as stale.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Accepts components of the owner and of root.
const fn may_attach(uid: u32, owner: u32) -> bool {
    uid == owner || uid == 0
}

/// The default path, in a directory that exists and is accessible to the owner alone.
pub(super) fn make_default() -> Result<PathBuf, Error> {
    let directory = directory();
    match DirBuilder::new().mode(0o700).create(&directory) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => {
            return Err(Error::io(format!("making {}", directory.display()))(error));
        }
        _ => check_directory(&directory, own_uid(), 0o077)?,
    }
    Ok(path())
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => path,
    }
}

/// Checks that no other user can put files into the directory: it belongs to this user or root, and
/// its mode has none of the bits in `forbidden`, except that a sticky directory, where only owners
/// can remove their files, is allowed for 0o022.
fn check_directory(directory: &Path, own: u32, forbidden: u32) -> Result<(), Error> {
    let unsafe_because = |why: String, remedy: String| {
        Err(Error::UnsafeDirectory {
            directory: directory.to_owned(),
            why,
            remedy,
        })
    };
    let doing = || format!("looking at {}", directory.display());
    let metadata = if forbidden == 0o077 {
        // The directory that this process creates itself must not be a symbolic link.
        fs::symlink_metadata(directory)
    } else {
        fs::metadata(directory)
    };
    let metadata = match metadata {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let remedy = format!("Create it: `mkdir -m 700 {}`", directory.display());
            return unsafe_because("it does not exist".into(), remedy);
        }
        other => other.map_err(Error::io(doing()))?,
    };
    let (uid, mode) = (metadata.uid(), metadata.mode() & 0o7777);
    if !metadata.is_dir() {
        return unsafe_because(
            "it is not a directory".into(),
            "Choose another path.".into(),
        );
    }
    if uid != own && uid != 0 {
        let why = format!("it belongs to user {uid}, but this process runs as user {own}");
        return unsafe_because(why, "Choose a directory of your own.".into());
    }
    let only_owners_remove = forbidden == 0o022 && mode & 0o1000 != 0;
    if mode & forbidden != 0 && !only_owners_remove {
        let why = format!("its mode is {mode:o}, so others can change its contents");
        let remedy = format!("Restrict it: `chmod 700 {}`", directory.display());
        return unsafe_because(why, remedy);
    }
    Ok(())
}

/// Listens on the socket, after replacing that of a dead node if necessary.
fn bind(path: &Path) -> Result<UnixListener, Error> {
    let failed = |source| Error::io(format!("listening at {}", path.display()))(source);
    match UnixListener::bind(path) {
        Err(error) if error.kind() == ErrorKind::AddrInUse => {}
        bound => return bound.map_err(failed),
    }
    let served = |pid| {
        let path = path.to_owned();
        Err(Error::Served { path, pid })
    };
    match look(path)? {
        Found::Nothing => {}
        Found::Other => return Err(Error::NoSocket(path.to_owned())),
        Found::Alive(pid) => return served(pid),
        // Renamed first: between the check and the removal, another node may have started.
        Found::Dead => {
            let aside = path.with_extension(format!("dead-{}", std::process::id()));
            match fs::rename(path, &aside) {
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                moved => moved.map_err(failed)?,
            }
            if let Found::Alive(pid) = look(&aside)? {
                let _ = fs::rename(&aside, path);
                return served(pid);
            }
            let _ = fs::remove_file(&aside);
            tracing::info!(path = %path.display(), "replaced the stale socket of a node");
        }
    }
    match UnixListener::bind(path) {
        Err(error) if error.kind() == ErrorKind::AddrInUse => served(None),
        bound => bound.map_err(failed),
    }
}

/// What exists at the socket's path.
enum Found {
    Nothing,
    Alive(Option<u32>),
    Dead,
    Other,
}

fn look(path: &Path) -> Result<Found, Error> {
    let doing = || format!("looking at {}", path.display());
    let metadata = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Found::Nothing),
        other => other.map_err(Error::io(doing()))?,
    };
    if !metadata.file_type().is_socket() {
        return Ok(Found::Other);
    }
    match try_connect(path) {
        Ok(stream) => {
            let pid = stream.peer_cred().ok().and_then(|peer| pid_of(&peer));
            Ok(Found::Alive(pid))
        }
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => Ok(Found::Dead),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Found::Nothing),
        // A listener with a full queue.
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(Found::Alive(None)),
        Err(error) => Err(Error::io(doing())(error)),
    }
}

/// Connects without waiting.
fn try_connect(path: &Path) -> io::Result<UnixStream> {
    use socket2::{Domain, SockAddr, Socket, Type};
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    socket.set_nonblocking(true)?;
    socket.connect(&SockAddr::unix(path)?)?;
    let stream = std::os::unix::net::UnixStream::from(std::os::fd::OwnedFd::from(socket));
    UnixStream::from_std(stream)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_owner_and_root_may_attach() {
        assert!(may_attach(1000, 1000) && may_attach(0, 1000));
        assert!(!may_attach(1001, 1000) && !may_attach(1000, 0));
    }
}
