//! The local link: how component processes of a host reach its node.
//!
//! A node that offers it listens on a Unix stream socket that only its owner may use, or on a TCP
//! port of loopback. **Each component has a connection of its own**: a component that does not read
//! fills its own socket and no other, the end of its process ends exactly its connection, and the
//! sender's id is that of the connection, not of the message.
//!
//! The connection carries [records](record) and not the frames of a stream link, because the
//! component has no endpoint: acknowledgements, duplicates, fragments and routes are the node's.
//! A message crosses whole, so that the kernel alone copies a large one, where AS5669A's size field
//! would cut it every 64 KiB; its record says what a frame has no field for: the path on which a
//! message came, and the number by which the component learns what became of it. An endpoint in each
//! component process would process every message of a host three times.
//!
//! | file | content |
//! |---|---|
//! | [`record`] | the records: pure functions between octets and records |
//! | `assembler` | records out of a stream, without I/O |
//! | `connection` | the two halves of a connection, the same on both sides |
//! | `stream` | the two kinds of stream, and the process at the other end |
//! | `address`, `usual_place` | where the node listens |
//! | `listener`, `unix_socket` | the node's side: directory and socket with their rights, stale sockets |
//!
//! [`node`](crate::node) reads and answers the records.

mod address;
mod assembler;
mod connection;
mod error;
mod listener;
pub mod record;
mod stream;
#[cfg(unix)]
mod unix_socket;
mod usual_place;

pub use address::{Address, InvalidAddress, Local};
pub use assembler::Assembler;
pub(crate) use connection::{Reader, Writer};
pub use error::Error;
pub(crate) use listener::Listener;
pub use stream::Process;
pub(crate) use stream::{Stream, connect};
