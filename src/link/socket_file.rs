//! The file of a bound Unix socket: its permissions, its removal, and the replacement of a file
//! that a crashed process has left behind.

use std::fs::{self, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use socket2::{Domain, SockAddr, Socket, Type};

/// The file of a bound socket. Dropping it removes the file, unless another one has replaced it.
#[derive(Debug)]
pub(crate) struct SocketFile {
    path: PathBuf,
    /// Device and inode.
    file: (u64, u64),
}

/// Why a socket cannot be bound to a path.
#[derive(Debug)]
pub(super) enum Obstacle {
    /// The socket of a living process is there. This one is connected to it, unless its queue is
    /// full.
    Alive(Option<Socket>),
    /// A file there is no socket.
    NoSocket,
    /// Any other error of the operating system.
    Io(io::Error),
}

impl From<io::Error> for Obstacle {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl SocketFile {
    /// Binds a non-blocking socket to a path, after removing that of a dead process if necessary.
    /// A stream socket listens. The file gets the permissions `mode`.
    pub(super) fn bind(path: &Path, kind: Type, mode: u32) -> Result<(Socket, Self), Obstacle> {
        let socket = match bind(path, kind) {
            Err(error) if error.kind() == ErrorKind::AddrInUse => {
                remove_dead(path, kind)?;
                bind(path, kind).map_err(|error| match error.kind() {
                    ErrorKind::AddrInUse => Obstacle::Alive(None),
                    _ => Obstacle::Io(error),
                })?
            }
            bound => bound?,
        };
        let file = Self {
            path: path.to_owned(),
            file: identity(&fs::symlink_metadata(path)?),
        };
        fs::set_permissions(path, Permissions::from_mode(mode))?;
        Ok((socket, file))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        let is_ours = |file: Metadata| identity(&file) == self.file;
        if fs::symlink_metadata(&self.path).is_ok_and(is_ours) {
            // The next process recognises a remaining file as stale.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn identity(file: &Metadata) -> (u64, u64) {
    (file.dev(), file.ino())
}

fn bind(path: &Path, kind: Type) -> io::Result<Socket> {
    let socket = Socket::new(Domain::UNIX, kind, None)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SockAddr::unix(path)?)?;
    if kind == Type::STREAM {
        // The system has its own limit.
        socket.listen(i32::MAX)?;
    }
    Ok(socket)
}

/// Removes the socket of a dead process.
fn remove_dead(path: &Path, kind: Type) -> Result<(), Obstacle> {
    if !is_dead(path, kind)? {
        return Ok(());
    }
    // Renamed first: between the check and the removal, another process may have bound its own. The
    // name is short because a socket's path is, and so one thread at a time uses it.
    static RENAMING: Mutex<()> = Mutex::new(());
    let _renaming = RENAMING.lock();
    let aside = path.with_file_name(format!(".{}", std::process::id()));
    match fs::rename(path, &aside) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        moved => moved?,
    }
    if let Err(obstacle) = is_dead(&aside, kind) {
        let _ = fs::rename(&aside, path);
        return Err(obstacle);
    }
    let _ = fs::remove_file(&aside);
    tracing::info!(path = %path.display(), "replaced the socket of a process that is gone");
    Ok(())
}

/// Whether there is the socket of a dead process; `false` if there is nothing. Nothing is sent to a
/// living one.
fn is_dead(path: &Path, kind: Type) -> Result<bool, Obstacle> {
    let file = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
        file => file?,
    };
    if !file.file_type().is_socket() {
        return Err(Obstacle::NoSocket);
    }
    let socket = Socket::new(Domain::UNIX, kind, None)?;
    socket.set_nonblocking(true)?;
    match socket.connect(&SockAddr::unix(path)?) {
        Ok(()) => Err(Obstacle::Alive(Some(socket))),
        Err(error) => match error.kind() {
            ErrorKind::ConnectionRefused => Ok(true),
            ErrorKind::NotFound => Ok(false),
            // A listener with a full queue.
            ErrorKind::WouldBlock => Err(Obstacle::Alive(None)),
            _ => Err(Obstacle::Io(error)),
        },
    }
}
