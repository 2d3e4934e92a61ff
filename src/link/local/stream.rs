//! The two kinds of stream that carry a local link, and the process at the other end.

use std::fmt;
use std::io;
use std::net::SocketAddr;

use tokio::net::TcpStream;
#[cfg(unix)]
use tokio::net::{UnixStream, unix::UCred};

#[cfg(not(unix))]
pub(crate) use self::elsewhere::{ReadHalf, WriteHalf};
#[cfg(unix)]
pub(crate) use self::on_unix::{ReadHalf, WriteHalf};
#[cfg(not(unix))]
use super::address::DEFAULT_PORT;
#[cfg(unix)]
use super::address::{default_path, own_uid};
#[cfg(unix)]
use super::unix_socket::is_guarded_by;
use super::{Address, Assembler, Error};

/// The process at the other end.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Process {
    /// Its process id, if the operating system reports it.
    pub pid: Option<u32>,
    /// The name that it has sent.
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

/// Both halves of a stream, and who is at the other end.
#[derive(Debug)]
pub(crate) struct Stream {
    pub(crate) read: ReadHalf,
    pub(crate) write: WriteHalf,
    pub(crate) peer: OtherEnd,
}

/// What the operating system reports of the other end; of a TCP connection nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OtherEnd {
    /// Its process.
    pub(crate) pid: Option<u32>,
    /// Its user.
    pub(crate) uid: Option<u32>,
}

#[cfg(unix)]
mod on_unix {
    //! Sockets of either kind, watched [for reading only](crate::link::watch), and for writing only
    //! while they are full.

    use std::io::{self, ErrorKind, IoSlice, Write};
    use std::net::Shutdown;
    use std::sync::Arc;
    use std::task::{Context, Poll, ready};

    use rustix::buffer::spare_capacity;
    use rustix::io::read;
    use socket2::Socket;
    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;

    use super::{Assembler, OtherEnd, Stream};
    use crate::link::watch::watch;

    /// The reading half of a stream.
    #[derive(Debug)]
    pub(crate) struct ReadHalf(AsyncFd<Arc<Socket>>);

    /// The writing half of a stream.
    #[derive(Debug)]
    pub(crate) struct WriteHalf {
        socket: Arc<Socket>,
        /// Watches for room while the socket is full.
        full: Option<AsyncFd<Socket>>,
    }

    impl Stream {
        pub(super) fn new(socket: impl Into<Socket>, peer: OtherEnd) -> io::Result<Self> {
            let socket = Arc::new(socket.into());
            Ok(Self {
                read: ReadHalf(watch(socket.clone(), Interest::READABLE)?),
                write: WriteHalf { socket, full: None },
                peer,
            })
        }
    }

    impl ReadHalf {
        /// Reads once, as much as fits; 0 octets mean the end.
        pub(in super::super) fn poll_read(
            &mut self,
            cx: &mut Context<'_>,
            assembler: &mut Assembler,
        ) -> Poll<io::Result<usize>> {
            loop {
                let mut ready = ready!(self.0.poll_read_ready(cx))?;
                let room = assembler.room();
                let octets = room.capacity() - room.len();
                let read = ready.try_io(|socket| Ok(read(socket.get_ref(), spare_capacity(room))?));
                let Ok(read) = read else { continue };
                match read {
                    Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                    // It is empty now. The kernel reports any further octets, and the end.
                    Ok(read) if read < octets => ready.clear_ready(),
                    _ => {}
                }
                return Poll::Ready(read);
            }
        }
    }

    impl WriteHalf {
        /// Writes as much as possible without waiting.
        pub(in super::super) fn try_write(&self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
            (&*self.socket).write_vectored(pieces)
        }

        /// Waits until a full socket may have room again.
        pub(in super::super) fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            let full = match &mut self.full {
                Some(full) => full,
                none => none.insert(watch(self.socket.try_clone()?, Interest::WRITABLE)?),
            };
            full.poll_write_ready(cx)
                .map_ok(|mut ready| ready.clear_ready())
        }

        /// Call this when nothing is left to write.
        pub(in super::super) fn rest(&mut self) {
            self.full = None;
        }
    }

    impl Drop for WriteHalf {
        /// Closes both directions, so that the other side sees the end even while the reading half
        /// is still held.
        fn drop(&mut self) {
            // An error means that it is already closed.
            let _ = self.socket.shutdown(Shutdown::Both);
        }
    }
}

#[cfg(not(unix))]
mod elsewhere {
    //! TCP sockets of the runtime.

    use std::io::{self, IoSlice};
    use std::pin::pin;
    use std::task::{Context, Poll};

    use bytes::BufMut;
    use tokio::io::AsyncReadExt;
    use tokio::net::{TcpStream, tcp};

    use super::{Assembler, OtherEnd, Stream};

    #[derive(Debug)]
    pub(crate) struct ReadHalf(tcp::OwnedReadHalf);

    #[derive(Debug)]
    pub(crate) struct WriteHalf(tcp::OwnedWriteHalf);

    impl Stream {
        pub(super) fn new(stream: std::net::TcpStream, peer: OtherEnd) -> io::Result<Self> {
            let (read, write) = TcpStream::from_std(stream)?.into_split();
            let (read, write) = (ReadHalf(read), WriteHalf(write));
            Ok(Self { read, write, peer })
        }
    }

    impl ReadHalf {
        pub(in super::super) fn poll_read(
            &mut self,
            cx: &mut Context<'_>,
            assembler: &mut Assembler,
        ) -> Poll<io::Result<usize>> {
            let room = assembler.room();
            let octets = room.capacity() - room.len();
            pin!(self.0.read_buf(&mut room.limit(octets))).poll(cx)
        }
    }

    impl WriteHalf {
        pub(in super::super) fn try_write(&self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
            self.0.try_write_vectored(pieces)
        }

        pub(in super::super) fn poll_room(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            self.0.as_ref().poll_write_ready(cx)
        }

        pub(in super::super) fn rest(&mut self) {}
    }
}

/// Both halves of a TCP stream.
pub(super) fn tcp_stream(stream: TcpStream) -> io::Result<Stream> {
    // Records are collected before they are written, so waiting for more would only delay them.
    let _ = stream.set_nodelay(true);
    Stream::new(stream.into_std()?, OtherEnd::default())
}

/// Both halves of a Unix stream, and the user id of the other end.
#[cfg(unix)]
pub(super) fn unix_stream(stream: UnixStream) -> io::Result<(Stream, u32)> {
    let peer = stream.peer_cred()?;
    let uid = peer.uid();
    let other = OtherEnd {
        pid: pid_of(&peer),
        uid: Some(uid),
    };
    Ok((Stream::new(stream.into_std()?, other)?, uid))
}

/// The process id of the other end, from its credentials.
#[cfg(unix)]
pub(super) fn pid_of(credentials: &UCred) -> Option<u32> {
    let pid = credentials.pid()?;
    // A process of another pid namespace appears as 0.
    u32::try_from(pid).ok().filter(|&pid| pid != 0)
}

/// Connects to the node that serves components at an address.
pub(crate) async fn connect(address: &Address) -> Result<Stream, Error> {
    match address {
        #[cfg(unix)]
        Address::Default => connect_unix(&default_path()).await,
        #[cfg(unix)]
        Address::Path(path) => connect_unix(path).await,
        #[cfg(not(unix))]
        Address::Default => connect_tcp(DEFAULT_PORT).await,
        #[cfg(not(unix))]
        Address::Path(_) => Err(Error::NoUnixSockets),
        Address::Tcp(port) => connect_tcp(*port).await,
    }
}

#[cfg(unix)]
async fn connect_unix(path: &std::path::Path) -> Result<Stream, Error> {
    let place = path.display().to_string();
    let stream = UnixStream::connect(path).await.and_then(unix_stream);
    let (stream, uid) = stream.map_err(|error| unreachable(&place, error))?;
    let own = own_uid();
    // Root may trust any user. A node of another user is one of the parts of a vehicle.
    let is_trusted = uid == own || uid == 0 || own == 0 || is_guarded_by(path, uid);
    if !is_trusted {
        return Err(Error::Foreign { place, uid, own });
    }
    Ok(stream)
}

async fn connect_tcp(port: SocketAddr) -> Result<Stream, Error> {
    let stream = TcpStream::connect(port).await.and_then(tcp_stream);
    stream.map_err(|error| unreachable(&port.to_string(), error))
}

fn unreachable(place: &str, error: io::Error) -> Error {
    use io::ErrorKind::{ConnectionRefused, NotFound};
    match error.kind() {
        ConnectionRefused | NotFound => Error::NoNode(place.to_owned()),
        _ => Error::io(format!("connecting to {place}"))(error),
    }
}
