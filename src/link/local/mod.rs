//! The local link: how component processes of a host reach its node.
//!
//! A node that offers it listens on a Unix stream socket that only its owner may use, or on a TCP
//! port of loopback. **Each component has a connection of its own**: so a component that does not
//! read fills its own socket and nobody else's, the end of its process ends exactly its
//! connection, and the id of whoever sends is that of the connection, not of the message.
//!
//! | file | what it is |
//! |---|---|
//! | [`record`] | what both sides say: pure functions between octets and records |
//! | `assembler` | whole records out of a stream of octets, without I/O |
//! | `outbox` | records on their way into the stream: small ones together, large ones uncopied |
//! | `address` | where the node is found |
//! | `door` | the node's side: directory and socket with their rights, stale sockets |
//! | `stream` | the two kinds of stream, and who is at the other end |
//! | `usual_place` | where the node is found by whoever is told nothing else |
//!
//! What to do with the records is the business of [`node`](crate::node).

mod address;
mod assembler;
mod connection;
mod door;
mod error;
mod outbox;
pub mod record;
mod stream;
#[cfg(unix)]
mod unix_door;
#[cfg(unix)]
mod unix_stream;
mod usual_place;

pub use address::{Address, InvalidAddress, Local};
pub use assembler::{Assembler, Body};
pub(crate) use connection::Connection;
pub(crate) use door::Door;
pub use error::Error;
pub(crate) use outbox::Outbox;
pub use stream::Process;
pub(crate) use stream::{Guest, WriteHalf, connect};
