//! Errors when opening a link, each with a remedy for people.

use std::io;
use std::net::{IpAddr, SocketAddr};

use super::group::InvalidGroup;
use super::holder::Holder;
use super::interface::{Available, Interface, Ip};

/// Why a link could not be opened. Nothing is left half open.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The name or address, as given, does not belong to this host; with the existing interfaces.
    #[error("there is no network interface `{0}` on this host; choose from: {1}")]
    NoSuchInterface(String, Available),
    /// The interface exists but is not up; with the existing interfaces.
    #[error(
        "the network interface {0} is not up: bring it up (`ip link set {name} up`) or choose \
         another: {1}",
        name = .0.name
    )]
    InterfaceDown(Interface, Available),
    /// The interface, as given, has addresses, but none of this IP version; with the existing
    /// interfaces.
    #[error(
        "the network interface `{0}` has no {ip} address: give it one, or set `ip` to another \
         version; choose from: {2}",
        ip = .1.name()
    )]
    NoAddress(String, Ip, Available),
    /// There is no interface to open a link on.
    #[error("no network interface is usable; found: {0}")]
    NoInterface(Available),
    /// Multicast is enabled, but no selected interface carries multicast or broadcasts.
    #[error(
        "none of the chosen interfaces has multicast ({0}), so discovery cannot work: choose \
         another interface, name peers by address, or turn the group off"
    )]
    NoMulticast(Available),
    /// The group is not a multicast address with a port.
    #[error(transparent)]
    InvalidGroup(#[from] InvalidGroup),
    /// The unicast address and port are in use.
    #[error(
        "UDP port {} of {} is taken{holder}. Each node of a host needs its own port or address, \
         because a datagram to a shared one reaches only one node. Choose another port (0: any \
         free one; peers answer to the source port), or another address (on loopback any of \
         127.0.0.0/8, such as 127.0.0.2), or stop the other program. {}",
        .address.port(), .address.ip(), holder_hint(holder, *address)
    )]
    PortTaken {
        /// The address that could not be bound.
        address: SocketAddr,
        /// Its holder, as far as this host reports it.
        holder: Holder,
    },
    /// Another program has the multicast group's port and does not share it.
    #[error(
        "the multicast group {group} cannot be received: UDP port {} is bound{holder} to all \
         addresses without sharing. Stop that program, or move both to another group and port, or \
         turn the group off and name peers by address. {}",
        .group.port(), holder_hint(holder, *group)
    )]
    GroupTaken {
        /// The group and its port.
        group: SocketAddr,
        /// Its holder, as far as this host reports it.
        holder: Holder,
    },
    /// The operating system refuses multicast.
    #[error(
        "multicast group {group} cannot be used on {interface}: {source}. An emulator or a sandbox \
         may have no multicast: turn the group off and name peers by address (--group off --peer \
         ADDRESS; in a settings file group = \"off\", peers = [\"ADDRESS\"])"
    )]
    GroupRefused {
        /// The group and its port.
        group: SocketAddr,
        /// The interface on which it was refused.
        interface: Interface,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Another program listens at that address.
    #[error(
        "TCP port {} of {} is taken: choose another, or another address of this host, or stop the \
         other program (find it with `sudo ss -ltnp 'sport = :{}'`)",
        .0.port(), .0.ip(), .0.port()
    )]
    ListenerTaken(SocketAddr),
    /// This process lacks a permission for an operation on this port.
    #[error("permission denied for {0} ({2}){hint}", hint = privileged(*.1))]
    Permission(String, u16, #[source] io::Error),
    /// The address disappeared between listing the interfaces and binding to it.
    #[error("{0} is not (or no longer) an address of this host")]
    AddressGone(IpAddr),
    /// Any other error of the operating system, with the attempted operation.
    #[error("{0} failed: {1}")]
    Io(String, #[source] io::Error),
}

impl Error {
    /// Whether another program has the port at present, so that a later attempt may succeed.
    #[must_use]
    pub const fn is_taken(&self) -> bool {
        matches!(
            self,
            Self::PortTaken { .. } | Self::GroupTaken { .. } | Self::ListenerTaken(_)
        )
    }

    /// Maps an error of the operating system.
    pub(super) fn io(doing: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        |source| Self::Io(doing.into(), source)
    }

    /// Maps an error of opening a socket for an address.
    pub(super) fn socket(doing: impl Into<String>, address: SocketAddr, source: io::Error) -> Self {
        let doing = doing.into();
        match source.kind() {
            io::ErrorKind::AddrNotAvailable => Self::AddressGone(address.ip()),
            io::ErrorKind::PermissionDenied => Self::Permission(doing, address.port(), source),
            _ => Self::Io(doing, source),
        }
    }
}

fn holder_hint(holder: &Holder, address: SocketAddr) -> String {
    match holder {
        _ if cfg!(unix) && holder.is_junior() => {
            "(It is Junior's node manager: connect through it with --junior, or junior = \"/tmp\" \
             in a settings file.)"
                .to_owned()
        }
        Holder::Process { pid, .. } => format!("(Stop it with `kill {pid}`.)"),
        _ => format!(
            "(Find it with `sudo ss -ulpn 'sport = :{}'`.)",
            address.port()
        ),
    }
}

const fn privileged(port: u16) -> &'static str {
    if port < 1024 && port != 0 {
        ": ports below 1024 need privileges, choose a higher one"
    } else {
        ": see the container's or the security module's settings"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn beside_junior_the_remedy_is_to_be_its_client() {
        let group = ([239, 255, 0, 1], 3794).into();
        let taken = |name: &str| {
            let (pid, name) = (7, name.to_owned());
            let holder = Holder::Process { pid, name };
            Error::GroupTaken { group, holder }.to_string()
        };
        for name in ["JuniorRTE", "NodeManager"] {
            assert!(taken(name).contains("with --junior"), "{}", taken(name));
        }
        for name in ["python3", "JTSNodeManager"] {
            assert!(!taken(name).contains("--junior"), "{}", taken(name));
        }
    }
}
