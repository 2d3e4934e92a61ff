//! Where a node is found by whoever is told nothing else.

#[cfg(unix)]
pub(super) use unix::{SOCKET, directory, own_uid, path};

/// Where a node is found on systems without Unix sockets.
#[cfg(not(unix))]
pub(super) const PORT: std::net::SocketAddr =
    std::net::SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 37940);

#[cfg(unix)]
mod unix {
    use std::path::PathBuf;

    use tokio::net::UnixStream;

    use super::super::Error;

    /// The socket's name in its directory.
    pub(in super::super) const SOCKET: &str = "node.sock";

    /// The usual path of the socket, whether it is there or not.
    pub(in super::super) fn path() -> Result<PathBuf, Error> {
        Ok(directory()?.join(SOCKET))
    }

    /// The usual directory: the user's own for what runs, if there is one.
    pub(in super::super) fn directory() -> Result<PathBuf, Error> {
        let given = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
        if let Some(directory) = given.filter(|directory| directory.is_absolute()) {
            return Ok(directory.join("jaus"));
        }
        let uid = own_uid()?;
        let of_user = PathBuf::from(format!("/run/user/{uid}"));
        if of_user.is_dir() {
            return Ok(of_user.join("jaus"));
        }
        Ok(PathBuf::from(format!("/tmp/jaus-{uid}")))
    }

    /// The user that this process acts for.
    pub(in super::super) fn own_uid() -> Result<u32, Error> {
        let doing = "asking the system who we are";
        let (one, _) = UnixStream::pair().map_err(Error::io(doing))?;
        let credentials = one.peer_cred().map_err(Error::io(doing))?;
        Ok(credentials.uid())
    }
}
