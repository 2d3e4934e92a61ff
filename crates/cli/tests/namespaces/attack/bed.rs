//! Additions of these tests to the test bed of four hosts and three cables.

use crate::testbed::{Host, Testbed};
use jaus_test_kit::hosts::{self, lay_cable};

/// The vehicle's address on the strangers' cable.
pub(crate) const TO_STRANGERS6: &str = "fd00:216:2::1";
/// The network whose addresses all belong to the strangers' host.
const STRANGERS6: &str = "fd00:217::/64";

impl Testbed {
    /// Runs `ip` on a host.
    pub(crate) fn ip(&self, host: Host, arguments: &[&str]) {
        hosts::ip(&[&["-n", &self.name(host)], arguments].concat()).unwrap();
    }

    /// Lays another cable between two hosts, with addresses .1 and .2 of the network.
    pub(crate) fn connect(&self, ends: [Host; 2], cable: &str, network: &str) {
        lay_cable(&ends.map(|it| self.name(it)), cable, network).unwrap();
    }

    /// Gives the cables IPv6 addresses, numbered like the IPv4 ones, and the strangers' host a
    /// whole network.
    pub(crate) fn add_ip6(&self) {
        let others = [Host::Controller, Host::Strangers, Host::Observer];
        for (number, other) in (1..).zip(others) {
            for (end, host) in [(1, Host::Vehicle), (2, other)] {
                let address = format!("fd00:216:{number}::{end}/64");
                let cable = other.cable();
                let add = ["-6", "address", "add", &address, "dev", cable, "nodad"];
                self.ip(host, &add);
            }
        }
        let route = ["-6", "route", "add", STRANGERS6, "via", "fd00:216:2::2"];
        self.ip(Host::Vehicle, &route);
        let local = ["-6", "route", "add", "local", STRANGERS6, "dev", "lo"];
        self.ip(Host::Strangers, &local);
        let bind = "echo 1 > /proc/sys/net/ipv6/ip_nonlocal_bind";
        let status = self.program(Host::Strangers, "sh", &["-c", bind]).status();
        assert!(status.unwrap().success());
    }

    /// Number of packets that a host has sent on its cables.
    pub(crate) fn packets_sent(&self, host: Host) -> u64 {
        let counts = "cd /sys/class/net; for it in *; do [ $it = lo ] || \
                      cat $it/statistics/tx_packets; done";
        let output = self.program(host, "sh", &["-c", counts]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().map(|it| it.parse::<u64>().unwrap()).sum()
    }
}

/// Writes a node's settings file; returns its path.
pub(crate) fn settings(name: &str, text: &str) -> String {
    let path = format!("{}/attack-{name}.toml", env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(&path, text).unwrap();
    path
}
