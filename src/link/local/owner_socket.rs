//! Unix sockets for the programs of one user, besides that of the node.

use std::path::{Path, PathBuf};

use tokio::net::{UnixListener, UnixStream};

use super::Error;
use super::address::{default_directory, own_uid};
use super::unix_socket::{Users, accept_owner, listen, make_default};
use crate::link::socket_file::SocketFile;

/// A listening Unix socket that only its owner and root can use: its mode is 0600, no other user can
/// replace it, and the operating system reports the user of each connecting process. Dropping it
/// removes the socket.
#[derive(Debug)]
pub struct OwnerSocket {
    listener: UnixListener,
    file: SocketFile,
}

impl OwnerSocket {
    /// The path of a socket beside that of the user's node.
    #[must_use]
    pub fn default_path(name: &str) -> PathBuf {
        default_directory().join(name)
    }

    /// Listens at a path. The user's directory for sockets is made if it is the path's.
    ///
    /// # Errors
    /// If a process listens there, or other users could replace the socket.
    pub fn listen(path: &Path) -> Result<Self, Error> {
        if path.parent() == Some(&default_directory()) {
            make_default()?;
        }
        let (listener, file) = listen(path, Users::Owner)?;
        Ok(Self { listener, file })
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Waits for a process of the owner or of root.
    ///
    /// # Errors
    /// If the connection failed or was one of another user, who got nothing.
    pub async fn accept(&self) -> Result<UnixStream, Error> {
        let accepted = self.listener.accept().await;
        let (stream, _) = accepted.map_err(Error::io("accepting a connection"))?;
        accept_owner(&stream, self.file.path(), own_uid())?;
        Ok(stream)
    }
}
