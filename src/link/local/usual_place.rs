//! The default address of a host's node.

#[cfg(unix)]
pub(super) use unix::{directory, own_uid, path};

/// The default address on systems without Unix sockets.
#[cfg(not(unix))]
pub(super) const PORT: std::net::SocketAddr =
    std::net::SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 37940);

#[cfg(unix)]
mod unix {
    use std::path::PathBuf;

    /// The default path of the socket, whether or not it exists.
    pub(in super::super) fn path() -> PathBuf {
        directory().join("node.sock")
    }

    /// The default directory: in the user's runtime directory, if there is one.
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

    /// The effective user id of this process.
    pub(in super::super) fn own_uid() -> u32 {
        rustix::process::geteuid().as_raw()
    }
}
