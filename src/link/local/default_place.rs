//! The default path of a node's Unix socket.

use std::path::PathBuf;

/// The default path of the socket, whether or not it exists.
pub(super) fn default_path() -> PathBuf {
    default_directory().join("node.sock")
}

/// The default directory: in the user's runtime directory, if there is one.
pub(super) fn default_directory() -> PathBuf {
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
pub(super) fn own_uid() -> u32 {
    rustix::process::geteuid().as_raw()
}
