//! Opens the sockets of a UDP link, and maps the errors.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use socket2::{Domain, InterfaceIndexOrAddress, Protocol, Socket, Type};

use super::{PortTaken, Settings};
use crate::link::socket::Socket as Opened;
use crate::link::{Error, Holder, Interface};

/// Opens the socket that sends everything, bound exclusively to the interface's address.
pub(super) fn unicast(interface: &Interface, settings: &Settings) -> Result<Opened, Error> {
    let wanted = interface.at(settings.port);
    let socket = new_socket(wanted)?;
    if let Err(e) = socket.bind(&wanted.into()) {
        let taken = e.kind() == io::ErrorKind::AddrInUse;
        if !taken || settings.port_taken == PortTaken::Refuse {
            return Err(bind_error(wanted, e));
        }
        let free = interface.at(0);
        socket.bind(&free.into()).map_err(|e| bind_error(free, e))?;
        tracing::warn!(%wanted, "port taken, using a free one instead");
    }
    for group in settings.addresses_of_all(interface) {
        prepare_sending(&socket, group.ip(), interface, settings)
            .map_err(|e| refused(group, interface, e))?;
    }
    finish(socket, settings.receive_buffer)
}

/// Enables a socket to send to a multicast or broadcast address.
fn prepare_sending(
    socket: &Socket,
    group: IpAddr,
    interface: &Interface,
    settings: &Settings,
) -> io::Result<()> {
    let hops = settings.ttl.into();
    // Loopback is on so that other nodes of this host receive it too.
    match (group, interface.address) {
        (IpAddr::V6(_), _) => {
            socket.set_multicast_if_v6(interface.index)?;
            socket.set_multicast_hops_v6(hops)?;
            socket.set_multicast_loop_v6(true)
        }
        (IpAddr::V4(v4), IpAddr::V4(own)) if v4.is_multicast() => {
            socket.set_multicast_if_v4(&own)?;
            socket.set_multicast_ttl_v4(hops)?;
            socket.set_multicast_loop_v4(true)
        }
        _ => socket.set_broadcast(true),
    }
}

/// Opens a socket that receives from a multicast or broadcast address, shared with other nodes of
/// the host.
pub(super) fn group(
    interface: &Interface,
    group: SocketAddr,
    settings: &Settings,
) -> Result<Opened, Error> {
    let socket = new_socket(group)?;
    socket
        .set_reuse_address(true)
        .map_err(Error::io("sharing the multicast port"))?;
    // Bound to the group itself, the socket gets no unicast, which is for the unicast socket.
    let local = match group {
        _ if !cfg!(windows) => group,
        SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, group.port()).into(),
        SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, group.port()).into(),
    };
    socket.bind(&local.into()).map_err(|e| match e.kind() {
        io::ErrorKind::AddrInUse => Error::GroupTaken {
            group,
            holder: Holder::of(group),
        },
        _ => bind_error(group, e),
    })?;
    join(&socket, group.ip(), interface).map_err(|e| refused(group, interface, e))?;
    finish(socket, settings.receive_buffer)
}

/// Joins the group on this interface. Unless `multicast_all` is disabled, Linux also delivers the
/// datagrams of groups that other sockets of this host joined on other interfaces.
fn join(socket: &Socket, group: IpAddr, interface: &Interface) -> io::Result<()> {
    match group {
        IpAddr::V4(v4) if v4.is_multicast() => {
            #[cfg(target_os = "linux")]
            socket.set_multicast_all_v4(false)?;
            let on = InterfaceIndexOrAddress::Index(interface.index);
            socket.join_multicast_v4_n(&v4, &on)
        }
        IpAddr::V6(v6) => {
            // It may fail: the option needs Linux 4.20. It is not needed where the group's address
            // names the interface.
            #[cfg(target_os = "linux")]
            let _ = socket.set_multicast_all_v6(false);
            socket.join_multicast_v6(&v6, interface.index)
        }
        // A broadcast address needs no joining.
        IpAddr::V4(_) => Ok(()),
    }
}

/// Maps the error of a system without multicast or broadcast, such as an emulator or a sandbox.
fn refused(group: SocketAddr, interface: &Interface, source: io::Error) -> Error {
    if group.ip().is_multicast() {
        return Error::GroupRefused {
            group,
            interface: interface.clone(),
            source,
        };
    }
    Error::io(format!("setting up {group} on {interface}"))(source)
}

fn new_socket(address: SocketAddr) -> Result<Socket, Error> {
    let domain = Domain::for_address(address);
    let socket = Socket::new(domain, Type::DGRAM, Some(Protocol::UDP))
        .map_err(|e| Error::socket("opening a UDP socket", (address.ip(), 0).into(), e))?;
    if address.is_ipv6() {
        // IPv4 links have their own sockets.
        socket
            .set_only_v6(true)
            .map_err(Error::io("keeping IPv4 out of an IPv6 socket"))?;
    }
    Ok(socket)
}

fn finish(socket: Socket, receive_buffer: usize) -> Result<Opened, Error> {
    // Linux reports twice the usable size: the other half is for its own bookkeeping.
    let granted = socket
        .set_recv_buffer_size(receive_buffer)
        .and_then(|()| socket.recv_buffer_size())
        .map_err(Error::io("setting the receive buffer size"))?;
    if granted < receive_buffer {
        tracing::info!(
            wanted = receive_buffer,
            granted,
            "the kernel limits the receive buffer; raise net.core.rmem_max to avoid losses in \
             bursts"
        );
    } else {
        tracing::debug!(granted, "receive buffer");
    }
    socket
        .set_nonblocking(true)
        .and_then(|()| Opened::new(socket.into()))
        .map_err(Error::io("handing the socket to the runtime"))
}

fn bind_error(address: SocketAddr, source: io::Error) -> Error {
    match source.kind() {
        io::ErrorKind::AddrInUse => Error::PortTaken {
            address,
            holder: Holder::of(address),
        },
        _ => Error::socket(format!("binding to UDP {address}"), address, source),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_group_that_cannot_be_joined_is_an_error_that_names_the_option_without_it() {
        let interface = Interface {
            name: "gone0".into(),
            index: u32::MAX,
            address: Ipv4Addr::LOCALHOST.into(),
            prefix: 8,
            up: true,
            multicast: true,
            broadcast: None,
        };
        let address = ([239, 255, 0, 77], 0).into();
        let error = group(&interface, address, &Settings::default()).unwrap_err();
        assert!(matches!(error, Error::GroupRefused { .. }), "{error}");
        let told = error.to_string();
        for part in ["239.255.0.77", "gone0", "--group off", "--peer ADDRESS"] {
            assert!(told.contains(part), "no `{part}` in {told}");
        }
    }
}
