//! Where a node is found by whoever is told nothing else.

#[cfg(unix)]
pub(super) use unix::{directory, own_uid, path};

/// Where a node is found on systems without Unix sockets.
#[cfg(not(unix))]
pub(super) const PORT: std::net::SocketAddr =
    std::net::SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 37940);

#[cfg(unix)]
mod unix {
    use std::path::PathBuf;

    /// The usual path of the socket, whether it is there or not.
    pub(in super::super) fn path() -> PathBuf {
        directory().join("node.sock")
    }

    /// The usual directory: the user's own for what runs, if there is one.
    pub(in super::super) fn directory() -> PathBuf {
        let given = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
        if let Some(directory) = given.filter(|directory| directory.is_absolute()) {
            return directory.join("jaus");
        }
        let uid = own_uid();
        let of_user = PathBuf::from(format!("/run/user/{uid}"));
        if of_user.is_dir() {
            return of_user.join("jaus");
        }
        PathBuf::from(format!("/tmp/jaus-{uid}"))
    }

    /// The user that this process acts for.
    pub(in super::super) fn own_uid() -> u32 {
        rustix::process::geteuid().as_raw()
    }
}
