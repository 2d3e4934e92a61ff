//! A node's Unix socket: directory and socket with their permissions.
//!
//! The socket is in a directory where no other user can replace it, and is accessible to the owner
//! alone, or to a group. In addition the operating system reports the user of each connecting process.

use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use socket2::{Socket, Type};
use tokio::net::{UnixListener, UnixStream};

use super::Error;
use super::address::{default_directory, default_path, own_uid};
use super::stream::{Stream, pid_of, unix_stream};
use crate::link::socket_file::{Obstacle, SocketFile};

/// Which processes may connect, besides those of root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Users {
    /// Those of the user of this process.
    Owner,
    /// Those whose groups contain the group of this process. The kernel checks it by the mode of the
    /// socket; they may be of any user.
    Group,
}

impl Users {
    const fn mode(self) -> u32 {
        match self {
            Self::Owner => 0o600,
            Self::Group => 0o660,
        }
    }
}

/// Listens at a path. Dropping the file removes it.
pub(super) fn listen(path: &Path, users: Users) -> Result<(UnixListener, SocketFile), Error> {
    check_directory(parent(path), own_uid(), 0o022)?;
    let failed = |source| Error::io(format!("listening at {}", path.display()))(source);
    let bound = SocketFile::bind(path, Type::STREAM, users.mode());
    let (socket, file) = bound.map_err(|obstacle| match obstacle {
        Obstacle::Alive(other) => Error::Served(path.to_owned(), other.and_then(server_of)),
        Obstacle::NoSocket => Error::NoSocket(path.to_owned()),
        Obstacle::Io(source) => failed(source),
    })?;
    let listener = UnixListener::from_std(socket.into()).map_err(failed)?;
    Ok((listener, file))
}

/// Waits for the next component.
pub(super) async fn accept(
    listener: &UnixListener,
    path: &Path,
    users: Users,
) -> Result<Stream, Error> {
    let accepted = listener.accept().await;
    let stream = accepted.and_then(|(stream, _)| unix_stream(stream));
    let (stream, uid) = stream.map_err(Error::io("accepting a component"))?;
    let own = own_uid();
    if users == Users::Owner && !may_attach(uid, own) {
        let place = path.display().to_string();
        return Err(Error::Foreign { place, uid, own });
    }
    Ok(stream)
}

/// Refuses a process of another user.
pub(super) fn accept_owner(stream: &UnixStream, path: &Path, own: u32) -> Result<(), Error> {
    let peer = stream
        .peer_cred()
        .map_err(Error::io("accepting a connection"))?;
    if may_attach(peer.uid(), own) {
        return Ok(());
    }
    Err(Error::Foreign {
        place: path.display().to_string(),
        uid: peer.uid(),
        own,
    })
}

/// The process id of the node that serves a connected socket.
fn server_of(socket: Socket) -> Option<u32> {
    let stream = UnixStream::from_std(socket.into()).ok()?;
    pid_of(&stream.peer_cred().ok()?)
}

/// Accepts components of the owner and of root.
const fn may_attach(uid: u32, owner: u32) -> bool {
    uid == owner || uid == 0
}

/// Whether nobody but root and this user can have put the socket at its path: each folder on the way
/// belongs to one of them, and no one else may write to it. A process may then attach to a node of
/// another user that it was told to attach to.
pub(super) fn is_guarded_by(path: &Path, uid: u32) -> bool {
    let is_guarded = |folder: &Path| {
        fs::metadata(folder)
            .is_ok_and(|it| (it.uid() == uid || it.uid() == 0) && it.mode() & 0o022 == 0)
    };
    // Symbolic links on the way could be those of others.
    let whole = fs::canonicalize(path);
    whole.is_ok_and(|whole| whole.ancestors().skip(1).all(is_guarded))
}

/// The default path, in a directory that exists and is accessible to the owner alone.
pub(super) fn make_default() -> Result<PathBuf, Error> {
    let directory = default_directory();
    match DirBuilder::new().mode(0o700).create(&directory) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => {
            return Err(Error::io(format!("making {}", directory.display()))(error));
        }
        _ => check_directory(&directory, own_uid(), 0o077)?,
    }
    Ok(default_path())
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => path,
    }
}

/// Checks that no other user can replace files in the directory: it belongs to this user or root,
/// and its mode has none of the bits in `forbidden`, except that a sticky directory, where only
/// owners can remove their files, is allowed for 0o022.
fn check_directory(directory: &Path, own: u32, forbidden: u32) -> Result<(), Error> {
    let shown = directory.display();
    let unsafe_because = |why| Err(Error::UnsafeDirectory(directory.to_owned(), why));
    let metadata = if forbidden == 0o077 {
        // The directory that this process creates itself must not be a symbolic link.
        fs::symlink_metadata(directory)
    } else {
        fs::metadata(directory)
    };
    let metadata = match metadata {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return unsafe_because(format!(
                "it does not exist. Create it: `mkdir -m 700 {shown}`"
            ));
        }
        other => other.map_err(Error::io(format!("looking at {shown}")))?,
    };
    let (uid, mode) = (metadata.uid(), metadata.mode() & 0o7777);
    if !metadata.is_dir() {
        return unsafe_because("it is not a directory. Choose another path.".to_owned());
    }
    if uid != own && uid != 0 {
        return unsafe_because(format!(
            "it belongs to user {uid}, but this process runs as user {own}. Choose a directory of \
             your own."
        ));
    }
    let only_owners_remove = forbidden == 0o022 && mode & 0o1000 != 0;
    if mode & forbidden != 0 && !only_owners_remove {
        return unsafe_because(format!(
            "its mode is {mode:o}, so others can change its contents. Restrict it: `chmod 700 \
             {shown}`"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_owner_and_root_may_attach() {
        assert!(may_attach(1000, 1000) && may_attach(0, 1000));
        assert!(!may_attach(1001, 1000) && !may_attach(1000, 0));
    }

    #[test]
    fn a_socket_in_a_folder_that_others_can_write_to_may_be_anybodys() {
        // The folder of temporary files is everybody's.
        let name = format!("jaus-guarded-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::write(&path, "").unwrap();
        assert!(!is_guarded_by(&path, own_uid()));
        fs::remove_file(&path).unwrap();
        assert!(is_guarded_by(Path::new("/usr/bin"), 0));
        assert!(is_guarded_by(Path::new("/usr/bin"), 4711), "root's");
        assert!(!is_guarded_by(Path::new("/nowhere/node.sock"), 0));
    }
}
