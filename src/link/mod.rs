//! Links: the sockets of a node. Octets in, octets out, with the peer's address.
//!
//! A link knows nothing of JAUS: the endpoint interprets the octets. There is one
//! [`UdpLink`](udp::UdpLink) per network interface, and one [`TcpLink`](tcp::TcpLink) for all
//! connections. The TCP link decodes the framing itself, because only the frames show where a
//! message ends. There is one `SerialLink` (feature `serial`) per serial line. A `JuniorLink` (on
//! Unix) may replace UDP; with it the node is a client of a Junior on the same host. Other crates
//! provide further links by [`CustomLink`](custom::CustomLink).
//!
//! # Several nodes on one host
//!
//! A link has one socket per kind of datagram, because their requirements conflict:
//!
//! * The **unicast socket** is bound exclusively to one address of the interface and the node's
//!   port. Everything leaves through it, so peers reply to it. If it were shared, each datagram
//!   would reach only one of the sharers, and it would be undefined which.
//! * A **group socket** is bound to the multicast group (or to the network's broadcast address,
//!   where that is used) and the group's port, shared (`SO_REUSEADDR`). Every sharer gets a copy of
//!   every datagram.
//!
//! So the rule is: **all nodes of a host share the group, and each has its own address and port.**
//! The first node takes the standard port 3794. A second one on the same address gets
//! [`Error::PortTaken`] and needs another port (0 for any free one) or another address. Peers need
//! no configuration: AS5669A peers (Junior, JAUS++ and this one) reply to the source address and
//! port of a node's datagrams.
//!
//! A program that binds port 3794 of *all* addresses without sharing, as Junior does, leaves no
//! room for either socket. One of the two has to move, or the node becomes its client (`junior`).
#![expect(clippy::disallowed_types, reason = "this module owns the sockets")]

pub mod backlog;
pub mod custom;
mod error;
mod group;
mod holder;
pub mod interface;
#[cfg(unix)]
pub mod junior;
pub mod local;
mod redial;
#[cfg(feature = "serial")]
pub mod serial;
mod slab;
pub mod socket;
#[cfg(unix)]
mod socket_file;
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
pub use socket_table::is_of_another_user;
pub(crate) use socket_table::is_ours;
