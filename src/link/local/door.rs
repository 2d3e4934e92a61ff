//! The node's side: where it listens, and who may come in.
//!
//! A Unix socket lies in a directory in which only its owner can put anything, and is for the
//! owner alone; whoever connects is asked for credentials all the same, so that nothing hangs on
//! the rights of files alone. What a crashed node has left behind is told from a living node by
//! trying to connect.

use std::io;
use std::net::SocketAddr;

use tokio::net::TcpListener;

use super::stream::{Guest, tcp_halves};
#[cfg(unix)]
use super::unix_door::{self, UnixDoor};
#[cfg(not(unix))]
use super::usual_place::PORT;
use super::{Address, Error};

/// Where component processes come in.
#[derive(Debug)]
pub(crate) enum Door {
    #[cfg(unix)]
    Unix(UnixDoor),
    Tcp(TcpListener),
}

impl Door {
    /// Opens it.
    pub(crate) fn open(address: &Address) -> Result<Self, Error> {
        match address {
            #[cfg(unix)]
            Address::Default => UnixDoor::open(&unix_door::make_default()?).map(Self::Unix),
            #[cfg(unix)]
            Address::Path(path) => UnixDoor::open(path).map(Self::Unix),
            #[cfg(not(unix))]
            Address::Default => Self::open_tcp(PORT),
            #[cfg(not(unix))]
            Address::Path(_) => Err(Error::NoUnixSockets),
            Address::Tcp(port) => Self::open_tcp(*port),
        }
    }

    fn open_tcp(port: SocketAddr) -> Result<Self, Error> {
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => Error::PortTaken(port),
            _ => Error::io(format!("listening on {port}"))(source),
        };
        let listen = || {
            // With the address reused, as is usual for listeners: not in spite of a living one.
            let listener = std::net::TcpListener::bind(port)?;
            listener.set_nonblocking(true)?;
            TcpListener::from_std(listener)
        };
        tracing::warn!(%port, "everybody on this host may attach components through a TCP port");
        listen().map(Self::Tcp).map_err(failed)
    }

    /// Waits for the next guest. An error concerns one guest and not the door.
    pub(crate) async fn accept(&self) -> Result<Guest, Error> {
        match self {
            #[cfg(unix)]
            Self::Unix(door) => door.accept().await,
            Self::Tcp(listener) => {
                let accepted = listener.accept().await;
                let (stream, _) = accepted.map_err(Error::io("accepting a component"))?;
                let (read, write) = tcp_halves(stream);
                let pid = None;
                Ok(Guest { read, write, pid })
            }
        }
    }

    /// Where it is, for people.
    pub(crate) fn place(&self) -> String {
        match self {
            #[cfg(unix)]
            Self::Unix(door) => door.path().display().to_string(),
            Self::Tcp(listener) => listener
                .local_addr()
                .map_or_else(|_| "a TCP port".to_owned(), |port| port.to_string()),
        }
    }
}
