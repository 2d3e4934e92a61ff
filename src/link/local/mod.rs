//! The local link: connects component processes of a host to its node.
//!
//! A node that offers it listens on a Unix stream socket that only its owner may use, or on a TCP
//! port of loopback. **Each component has its own connection**: a component that does not read
//! fills only its own socket, the end of its process ends exactly its connection, and the sender's
//! id comes from the connection, not from the message.
//!
//! The connection carries [records](record) instead of the frames of a stream link, because the
//! component has no endpoint: the node handles acknowledgements, duplicates, fragments and routes.
//! A message is transferred whole, so that only the kernel copies a large one, whereas AS5669A's
//! size field would split it every 64 KiB. A record has fields that a frame lacks: the path on
//! which a message arrived, and the handle for its outcome. With an endpoint in each component
//! process, every message within a host would be processed three times.
//!
//! | file | content |
//! |---|---|
//! | [`record`] | the records: pure functions between octets and records |
//! | `assembler` | extracts records from a stream, without I/O |
//! | `connection` | the two halves of a connection, the same on both sides |
//! | `stream` | the two kinds of stream, and the process at the other end |
//! | `address` | the address at which the node listens |
//! | `owner_socket` | the same permissions for sockets of other servers |
//! | `listener`, `unix_socket` | the node's side: directory and socket with their permissions |
//!
//! [`node`](crate::node) reads and answers the records.

mod address;
mod assembler;
mod connection;
mod error;
mod listener;
#[cfg(unix)]
mod owner_socket;
pub mod record;
mod stream;
#[cfg(unix)]
mod unix_socket;

pub use address::{Address, InvalidAddress, Local};
pub use assembler::Assembler;
pub(crate) use connection::{Reader, Writer};
pub use error::Error;
pub(crate) use listener::Listener;
#[cfg(unix)]
pub use owner_socket::OwnerSocket;
pub use stream::Process;
pub(crate) use stream::{OtherEnd, Stream, connect};
