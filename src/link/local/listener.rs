//! The listener of a node for component processes.

use std::net::SocketAddr;

use tokio::net::TcpListener;
#[cfg(unix)]
use tokio::net::UnixListener;

#[cfg(not(unix))]
use super::address::DEFAULT_PORT;
use super::stream::{Stream, tcp_stream};
#[cfg(unix)]
use super::unix_socket::{self, Users};
use super::{Address, Error};
#[cfg(unix)]
use crate::link::socket_file::SocketFile;
use crate::link::tcp::listen;

/// The node's side of a local link.
#[derive(Debug)]
pub(crate) enum Listener {
    #[cfg(unix)]
    Unix(UnixListener, SocketFile, Users),
    Tcp(TcpListener),
}

impl Listener {
    /// Listens; for the processes of this process's group, too, if it `is_for_group`.
    pub(crate) fn open(address: &Address, is_for_group: bool) -> Result<Self, Error> {
        #[cfg(unix)]
        let users = match is_for_group {
            true => Users::Group,
            false => Users::Owner,
        };
        #[cfg(not(unix))]
        let _ = is_for_group;
        match address {
            #[cfg(unix)]
            Address::Default => Self::listen_at(&unix_socket::make_default()?, users),
            #[cfg(unix)]
            Address::Path(path) => Self::listen_at(path, users),
            #[cfg(not(unix))]
            Address::Default => Self::listen(DEFAULT_PORT),
            #[cfg(not(unix))]
            Address::Path(_) => Err(Error::NoUnixSockets),
            Address::Tcp(port) => Self::listen(*port),
        }
    }

    #[cfg(unix)]
    fn listen_at(path: &std::path::Path, users: Users) -> Result<Self, Error> {
        let (listener, file) = unix_socket::listen(path, users)?;
        Ok(Self::Unix(listener, file, users))
    }

    fn listen(port: SocketAddr) -> Result<Self, Error> {
        tracing::warn!(%port, "any program on this host can attach components through a TCP port");
        Ok(Self::Tcp(listen(port)?))
    }

    /// Waits for the next component. An error concerns only that component.
    pub(crate) async fn accept(&self) -> Result<Stream, Error> {
        match self {
            #[cfg(unix)]
            Self::Unix(listener, file, users) => {
                unix_socket::accept(listener, file.path(), *users).await
            }
            Self::Tcp(listener) => {
                let accepted = listener.accept().await;
                let stream = accepted.and_then(|(stream, _)| tcp_stream(stream));
                stream.map_err(Error::io("accepting a component"))
            }
        }
    }

    /// Its address, for people.
    pub(crate) fn place(&self) -> String {
        match self {
            #[cfg(unix)]
            Self::Unix(_, file, _) => file.path().display().to_string(),
            Self::Tcp(listener) => listener
                .local_addr()
                .map_or_else(|_| "a TCP port".to_owned(), |port| port.to_string()),
        }
    }
}
