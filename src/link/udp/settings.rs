//! The settings of a UDP link: port, multicast group, broadcast, TTL, buffers.

use std::net::SocketAddr;

use crate::link::group::{Group, Group6, STANDARD_PORT};
use crate::link::{Interface, InvalidGroup};

/// What to do when another socket has the unicast address and port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum PortTaken {
    /// Refuse to start, with an error.
    #[default]
    Refuse,
    /// Use any free port instead, and log a warning. Peers learn the port from our datagrams.
    /// Only peers that have this node's port in their configuration cannot reach it.
    UseFree,
}

/// When to send messages for all nodes to the broadcast address of the attached network (such as
/// `10.0.0.255`). Only IPv4 has one, on Ethernet and similar networks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Broadcasts {
    /// Instead of the group, on interfaces without multicast.
    #[default]
    Auto,
    /// Always, in addition to the group: for networks that lose multicast. Peers that receive both
    /// get every message twice; Junior and this implementation detect the duplicates.
    On,
    /// Never.
    Off,
}

/// The settings of a [`UdpLink`](super::UdpLink).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The unicast port; 0 takes any free one.
    pub port: u16,
    /// What to do if `port` is taken.
    pub port_taken: PortTaken,
    /// The multicast group and its port.
    pub group: Group,
    /// The same for links with an IPv6 address.
    pub group6: Group6,
    /// When to use the network's broadcast address, with the port of `group`, or 3794 if it is off.
    pub broadcast: Broadcasts,
    /// The TTL of multicast datagrams, 0 to 255; 0 keeps them on this host.
    pub ttl: u8,
    /// The receive buffer to request from the kernel for each socket, in octets.
    pub receive_buffer: usize,
    /// Whether to send and receive several datagrams with one system call. Linux only.
    pub batch: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            port: STANDARD_PORT,
            port_taken: PortTaken::Refuse,
            group: Group::default(),
            group6: Group6::default(),
            broadcast: Broadcasts::default(),
            ttl: 16,
            receive_buffer: 4 << 20,
            batch: true,
        }
    }
}

impl Settings {
    /// Checks that the groups are multicast addresses with a port.
    ///
    /// # Errors
    /// [`InvalidGroup`], with the valid range.
    pub fn validate(&self) -> Result<(), InvalidGroup> {
        self.group.validate()?;
        self.group6.validate()
    }

    /// Whether discovery cannot work on the interface: a group is configured, but the interface
    /// carries no multicast, and broadcast is off or unavailable.
    #[must_use]
    pub fn is_deaf_on(&self, interface: &Interface) -> bool {
        self.multicast(interface).is_some() && self.addresses_of_all(interface).is_empty()
    }

    /// The multicast and broadcast addresses that reach all nodes on the interface's network.
    pub(super) fn addresses_of_all(&self, interface: &Interface) -> Vec<SocketAddr> {
        let multicast = self.multicast(interface).filter(|_| interface.multicast);
        let broadcast = self.broadcast(interface);
        multicast.into_iter().chain(broadcast).collect()
    }

    /// The group for the interface's IP version, on this interface.
    fn multicast(&self, interface: &Interface) -> Option<SocketAddr> {
        if interface.address.is_ipv4() {
            return self.group.address();
        }
        let Group6::At(mut group) = self.group6 else {
            return None;
        };
        group.set_scope_id(interface.index);
        Some(group.into())
    }

    fn broadcast(&self, interface: &Interface) -> Option<SocketAddr> {
        let wanted = match self.broadcast {
            Broadcasts::Auto => !interface.multicast && self.group != Group::Off,
            Broadcasts::On => true,
            Broadcasts::Off => false,
        };
        let port = self.group.address().map_or(STANDARD_PORT, |g| g.port());
        let address = interface.broadcast.filter(|_| wanted)?;
        Some(SocketAddr::new(address.into(), port))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(address: &str, multicast: bool, broadcast: Option<[u8; 4]>) -> Interface {
        Interface {
            name: "eth0".into(),
            index: 2,
            address: address.parse().unwrap(),
            prefix: 24,
            up: true,
            multicast,
            broadcast: broadcast.map(Into::into),
        }
    }

    fn all(settings: &Settings, interface: &Interface) -> Vec<String> {
        let addresses = settings.addresses_of_all(interface);
        addresses.iter().map(ToString::to_string).collect()
    }

    fn settings(group: Group, broadcast: Broadcasts) -> Settings {
        Settings {
            group,
            broadcast,
            ..Settings::default()
        }
    }

    #[test]
    fn everyone_is_reached_by_multicast_or_else_by_broadcast_or_by_both_on_demand() {
        let ethernet = interface("10.0.0.5", true, Some([10, 0, 0, 255]));
        let bare = interface("10.0.0.5", false, Some([10, 0, 0, 255]));
        let group: Group = "239.255.0.1:4000".parse().unwrap();
        let with = |broadcast| settings(group, broadcast);
        let (multicast, broadcast) = ("239.255.0.1:4000", "10.0.0.255:4000");
        assert_eq!(all(&with(Broadcasts::Auto), &ethernet), [multicast]);
        assert_eq!(all(&with(Broadcasts::Auto), &bare), [broadcast]);
        assert_eq!(
            all(&with(Broadcasts::On), &ethernet),
            [multicast, broadcast]
        );
        assert_eq!(all(&with(Broadcasts::On), &bare), [broadcast]);
        assert!(all(&with(Broadcasts::Off), &bare).is_empty());
        assert!(with(Broadcasts::Off).is_deaf_on(&bare));
        assert!(!with(Broadcasts::Auto).is_deaf_on(&bare));
    }

    #[test]
    fn without_a_group_broadcast_is_used_on_demand_alone() {
        let bare = interface("10.0.0.5", false, Some([10, 0, 0, 255]));
        let with = |broadcast| settings(Group::Off, broadcast);
        assert!(all(&with(Broadcasts::Auto), &bare).is_empty());
        assert_eq!(all(&with(Broadcasts::On), &bare), ["10.0.0.255:3794"]);
        assert!(!with(Broadcasts::Auto).is_deaf_on(&bare));
    }

    #[test]
    fn the_group_of_ipv6_is_that_of_the_interface() {
        let ethernet = interface("fe80::5", true, None);
        let usual = Settings::default();
        assert_eq!(all(&usual, &ethernet), ["[ff12::efff:1%2]:3794"]);
        let tunnel = interface("fd00::5", false, None);
        assert!(usual.is_deaf_on(&tunnel));
    }
}
