//! A multicast group per test, so that simultaneous tests do not discover each other.
#![allow(
    clippy::disallowed_types,
    reason = "asks the operating system for free ports"
)]

use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};

use jaus::link::Group;

/// A group at a free port.
pub fn own_group() -> Group {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
    let port = socket.local_addr().unwrap().port();
    Group::At(SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 1), port))
}
