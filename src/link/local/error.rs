//! Errors of a local link, with their remedies.

use std::io;
use std::path::PathBuf;

use super::record::RecordError;
use crate::link;

/// Why a node cannot serve the component processes of its host, or a component cannot reach it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No node listens at this address.
    #[error(
        "no node serves components at {0}: start one with `jaus node --local` (or `local = …` \
         in its settings), or give the component its own node"
    )]
    NoNode(String),
    /// Another node is using the socket; with its process id, if the system reports it.
    #[error(
        "another node{} serves the components at {}: stop it, or choose another path for one of \
         the two", process(*.1), .0.display()
    )]
    Served(PathBuf, Option<u32>),
    /// A file of another kind has the socket's path.
    #[error(
        "cannot create the local link's socket: {} exists and is not a socket. Choose another \
         path, or move it", .0.display()
    )]
    NoSocket(PathBuf),
    /// Other users could replace the socket in this directory by their own; with what is wrong with
    /// it and the remedy.
    #[error("the directory {path} of the local link's socket is unsafe: {1}", path = .0.display())]
    UnsafeDirectory(PathBuf, String),
    /// The process at the other end belongs to another user.
    #[error(
        "the process at the other end of {place} belongs to user {uid}, not to our user {own} or \
         root: run components and node as one user, or set `local_group` of the node and attach as a \
         member of its group, at a socket in a directory where only the node's user and root can write"
    )]
    Foreign {
        /// The address.
        place: String,
        /// The user id of its owner.
        uid: u32,
        /// The user id of this process.
        own: u32,
    },
    /// The other side violated the protocol.
    #[error("protocol error on the local link: {0}")]
    Record(#[from] RecordError),
    /// The other side is gone.
    #[error("the connection was closed by the other side")]
    Closed,
    /// The other side did not answer at this address.
    #[error(
        "no greeting from {0}: the program there hangs or is not a node; find it with `ss -xlp` or \
         `ss -tlp`"
    )]
    Mute(String),
    /// This system has no Unix sockets.
    #[error("this system has no Unix sockets: use a loopback port such as 127.0.0.1:37940")]
    NoUnixSockets,
    /// A port in use, or any other error of the operating system.
    #[error(transparent)]
    Socket(#[from] link::Error),
}

impl Error {
    pub(crate) fn io(doing: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        |source| link::Error::io(doing)(source).into()
    }
}

fn process(pid: Option<u32>) -> String {
    pid.map_or_else(String::new, |pid| format!(" (process {pid})"))
}
