//! The address of a host's node: a socket in the file system, or a port of loopback.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

use crate::as_text::serde_as_text;

/// The default address on systems without Unix sockets.
#[cfg(not(unix))]
pub(super) const DEFAULT_PORT: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 37940);

/// The default path of the socket, whether or not it exists.
#[cfg(unix)]
pub(super) fn default_path() -> PathBuf {
    default_directory().join("node.sock")
}

/// The default directory: in the user's runtime directory, if there is one.
#[cfg(unix)]
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
#[cfg(unix)]
pub(super) fn own_uid() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Where a node serves the component processes of its host: `default`, the path of a socket, or a
/// port of loopback such as `127.0.0.1:3795`.
///
/// The default is `jaus/node.sock` in the user's runtime directory (`$XDG_RUNTIME_DIR`, else
/// `/run/user/UID`), or `/tmp/jaus-UID/node.sock` if there is none; on systems without Unix
/// sockets, port 127.0.0.1:37940.
///
/// A Unix socket is for the processes of one user (and root), and the operating system identifies
/// the process at the other end. **A port of loopback is open to everyone who can run a program on
/// the host**: use it only if there is no alternative.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub enum Address {
    /// The default place.
    #[default]
    Default,
    /// A Unix stream socket.
    Path(PathBuf),
    /// A TCP port of loopback.
    Tcp(SocketAddr),
}

/// Whether a node serves the component processes of its host: `off`, or where, as an [`Address`]:
/// `default`, the path of a socket, or a port of loopback such as `127.0.0.1:3795`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub enum Local {
    /// It does not.
    #[default]
    Off,
    /// It does, at this address.
    At(Address),
}

/// Not the address of a local link.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not an address of a local link: write `default`, a socket path such as \
     /run/jaus/node.sock or ./node.sock, or a loopback port such as 127.0.0.1:37940"
)]
pub struct InvalidAddress(String);

impl FromStr for Address {
    type Err = InvalidAddress;

    fn from_str(text: &str) -> Result<Self, InvalidAddress> {
        let wrong = || InvalidAddress(text.to_owned());
        if text == "default" {
            return Ok(Self::Default);
        }
        if text.contains('/') && !text.ends_with('/') {
            return Ok(Self::Path(text.into()));
        }
        let port: SocketAddr = text.parse().map_err(|_| wrong())?;
        let usable = port.ip().is_loopback() && port.port() != 0;
        usable.then_some(Self::Tcp(port)).ok_or_else(wrong)
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => f.pad("default"),
            Self::Path(path) => path.display().fmt(f),
            Self::Tcp(port) => port.fmt(f),
        }
    }
}

impl FromStr for Local {
    type Err = InvalidAddress;

    fn from_str(text: &str) -> Result<Self, InvalidAddress> {
        match text {
            "off" => Ok(Self::Off),
            text => text.parse().map(Self::At),
        }
    }
}

impl fmt::Display for Local {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.pad("off"),
            Self::At(address) => address.fmt(f),
        }
    }
}

serde_as_text!(Local);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_local_link_is_off_or_at_the_usual_place_a_path_or_a_port_of_loopback() {
        for text in [
            "off",
            "default",
            "/run/jaus/x.sock",
            "127.0.0.1:37940",
            "[::1]:37940",
        ] {
            let local: Local = text.parse().unwrap();
            assert_eq!(local.to_string(), text);
        }
    }

    #[test]
    fn what_others_could_reach_is_refused_with_what_would_do() {
        for wrong in [
            "",
            "on",
            "10.0.0.1:3794",
            "0.0.0.0:3794",
            "127.0.0.1:0",
            "/run/",
        ] {
            let error = wrong.parse::<Local>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("127.0.0.1:37940"), "{error}");
        }
    }
    #[test]
    #[cfg(feature = "serde")]
    fn a_mistake_in_a_settings_file_is_named_with_its_place_and_what_would_do() {
        let error = toml::from_str::<crate::node::Config>("local = \"10.0.0.1:3794\"");
        let error = error.unwrap_err().to_string();
        assert!(
            error.contains("line 1") && error.contains("`10.0.0.1:3794`"),
            "{error}"
        );
        assert!(error.contains("127.0.0.1:37940"), "{error}");
    }
}
