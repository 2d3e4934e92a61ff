//! Links: sockets, and nothing but sockets. Bytes in, bytes out, with the peer's address.
//!
//! A link knows no JAUS: what the bytes mean is the endpoint's business. There is one
//! [`UdpLink`](udp::UdpLink) per network interface, and one [`TcpLink`](tcp::TcpLink) for all
//! connections, which reads the frames itself, because only they tell where one ends;
//! there may be a `SerialLink` (feature `serial`) for each serial line. In the place of UDP there may
//! be a `JuniorLink` (on Unix), by which the node is a client of a Junior on the same host.
//!
//! # Several nodes on one host
//!
//! A link has a socket for each kind of datagram, because they want opposite things:
//!
//! * the **unicast socket** is bound to one address of the interface and the node's port, for
//!   itself alone. Everything leaves through it, so peers answer to it. Were it shared, each
//!   datagram would reach only one of the sharers, and nobody could say which;
//! * a **group socket** is bound to the multicast group (or to the network's broadcast address,
//!   where that is used) and the group's port, shared (`SO_REUSEADDR`). Every sharer gets a copy of
//!   every datagram.
//!
//! So the rule is: **all nodes of a host share the group, and each has an address and port of
//! its own.** The first takes the standard port 3794; a second one on the same address gets
//! [`Error::PortTaken`] and needs another port (0 for any free one) or another address. No peer
//! has to be told: AS5669A peers (Junior, JAUS++ and this one) answer to the address and port
//! that they hear a node from.
//!
//! A program that binds port 3794 of *all* addresses without sharing, as Junior does, leaves no
//! room for either socket: one of the two has to move, or the node becomes its client (`junior`).
#![expect(clippy::disallowed_types, reason = "this is where sockets live")]

pub(crate) mod backlog;
mod error;
mod group;
mod holder;
pub mod interface;
#[cfg(unix)]
pub mod junior;
pub mod local;
#[cfg(feature = "serial")]
pub mod serial;
mod slab;
mod socket_table;
pub mod tcp;
pub mod udp;
#[cfg(unix)]
mod watch;

pub use error::Error;
pub use group::{
    Group, Group6, GroupAddress, InvalidGroup, STANDARD_GROUP, STANDARD_GROUP6, STANDARD_PORT,
};
pub use holder::Holder;
pub use interface::{Available, Interface, Interfaces, Ip, Place};
pub use slab::Slab;
