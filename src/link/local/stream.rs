//! The two kinds of stream that carry a local link, and who is at the other end.

use std::fmt;
use std::io::{self, IoSlice};
use std::pin::{Pin, pin};
use std::task::{Context, Poll, ready};

use bytes::BufMut;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, ReadBuf};
use tokio::net::{TcpStream, tcp};
#[cfg(unix)]
use tokio::net::{UnixStream, unix::UCred};

#[cfg(unix)]
use super::unix_stream::{UnixReadHalf, UnixWriteHalf, halves};
use super::{Address, Error, usual_place};

/// The process at the other end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Process {
    /// Its number, where the operating system tells.
    pub pid: Option<u32>,
    /// What it calls itself.
    pub name: String,
}

impl fmt::Display for Process {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.pid, self.name.as_str()) {
            (Some(pid), "") => write!(f, "process {pid}"),
            (Some(pid), name) => write!(f, "\"{name}\" (process {pid})"),
            (None, "") => f.pad("another process"),
            (None, name) => write!(f, "\"{name}\""),
        }
    }
}

/// Somebody at a node's door.
#[derive(Debug)]
pub(crate) struct Guest {
    pub(crate) read: ReadHalf,
    pub(crate) write: WriteHalf,
    /// The number of its process, where the system tells.
    pub(crate) pid: Option<u32>,
}

/// The half of a stream that is read.
#[derive(Debug)]
pub(crate) enum ReadHalf {
    #[cfg(unix)]
    Unix(UnixReadHalf),
    Tcp(tcp::OwnedReadHalf),
}

/// The half of a stream that is written. When it is dropped the other side sees the end.
#[derive(Debug)]
pub(crate) enum WriteHalf {
    #[cfg(unix)]
    Unix(UnixWriteHalf),
    Tcp(tcp::OwnedWriteHalf),
}

impl ReadHalf {
    /// Reads once; 0 octets mean the end.
    pub(super) fn poll_read(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
    ) -> Poll<io::Result<usize>> {
        match self {
            #[cfg(unix)]
            Self::Unix(stream) => stream.poll_read(cx, buffer),
            Self::Tcp(stream) => {
                let mut buffer = ReadBuf::new(buffer);
                ready!(Pin::new(stream).poll_read(cx, &mut buffer))?;
                Poll::Ready(Ok(buffer.filled().len()))
            }
        }
    }

    /// Appends up to `most` octets to a buffer, which should have room for them; 0 mean the end.
    pub(super) fn poll_append(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut Vec<u8>,
        most: usize,
    ) -> Poll<io::Result<usize>> {
        match self {
            #[cfg(unix)]
            Self::Unix(stream) => stream.poll_append(cx, buffer, most),
            Self::Tcp(stream) => pin!(stream.read_buf(&mut buffer.limit(most))).poll(cx),
        }
    }
}

impl WriteHalf {
    /// Writes as much as can be written without waiting.
    pub(super) fn try_write(&self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
        match self {
            #[cfg(unix)]
            Self::Unix(stream) => stream.try_write(pieces),
            Self::Tcp(stream) => stream.try_write_vectored(pieces),
        }
    }

    pub(super) fn poll_write(
        &mut self,
        cx: &mut Context<'_>,
        pieces: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        match self {
            #[cfg(unix)]
            Self::Unix(stream) => stream.poll_write(cx, pieces),
            Self::Tcp(stream) => Pin::new(stream).poll_write_vectored(cx, pieces),
        }
    }

    /// Nothing waits to be written any more.
    pub(super) fn rest(&mut self) {
        #[cfg(unix)]
        if let Self::Unix(stream) = self {
            stream.rest();
        }
    }
}

#[cfg(unix)]
pub(super) fn unix_halves(stream: UnixStream) -> Result<(ReadHalf, WriteHalf), Error> {
    let (read, write) = halves(stream).map_err(Error::io("taking up a local connection"))?;
    Ok((ReadHalf::Unix(read), WriteHalf::Unix(write)))
}

pub(super) fn tcp_halves(stream: TcpStream) -> (ReadHalf, WriteHalf) {
    // Records are collected before they are written; waiting for more would only delay them.
    let _ = stream.set_nodelay(true);
    let (read, write) = stream.into_split();
    (ReadHalf::Tcp(read), WriteHalf::Tcp(write))
}

/// The number of the process at the other end, as credentials tell it.
#[cfg(unix)]
pub(super) fn pid_of(credentials: &UCred) -> Option<u32> {
    let pid = credentials.pid()?;
    // 0 is what a process of another pid namespace looks like.
    u32::try_from(pid).ok().filter(|&pid| pid != 0)
}

/// Reaches the node that serves components at an address.
pub(crate) async fn connect(address: &Address) -> Result<(ReadHalf, WriteHalf), Error> {
    match address {
        #[cfg(unix)]
        Address::Default => connect_unix(&usual_place::path()?).await,
        #[cfg(unix)]
        Address::Path(path) => connect_unix(path).await,
        #[cfg(not(unix))]
        Address::Default => connect_tcp(usual_place::PORT).await,
        #[cfg(not(unix))]
        Address::Path(_) => Err(Error::NoUnixSockets),
        Address::Tcp(port) => connect_tcp(*port).await,
    }
}

#[cfg(unix)]
async fn connect_unix(path: &std::path::Path) -> Result<(ReadHalf, WriteHalf), Error> {
    use io::ErrorKind::{ConnectionRefused, NotFound};
    let place = || path.display().to_string();
    let stream = UnixStream::connect(path).await;
    let stream = stream.map_err(|source| match source.kind() {
        ConnectionRefused | NotFound => Error::NoNode { place: place() },
        _ => Error::io(format!("connecting to {}", path.display()))(source),
    })?;
    let credentials = stream
        .peer_cred()
        .map_err(Error::io("asking the system whose node that is"))?;
    let (uid, own) = (credentials.uid(), usual_place::own_uid()?);
    // Root may do everything, also trust whom it likes.
    if uid != own && uid != 0 && own != 0 {
        return Err(Error::Foreign {
            place: place(),
            uid,
            own,
        });
    }
    unix_halves(stream)
}

async fn connect_tcp(port: std::net::SocketAddr) -> Result<(ReadHalf, WriteHalf), Error> {
    let stream = TcpStream::connect(port).await;
    let stream = stream.map_err(|source| match source.kind() {
        io::ErrorKind::ConnectionRefused => Error::NoNode {
            place: port.to_string(),
        },
        _ => Error::io(format!("connecting to {port}"))(source),
    })?;
    Ok(tcp_halves(stream))
}
