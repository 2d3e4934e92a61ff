//! Two hosts on a switch, with an observer: three network namespaces, isolated from the rest of
//! this machine. Dropping them removes them with all their processes.

use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use jaus_test_kit::hosts::ip;

/// Name of the network interface on both hosts.
pub(crate) const INTERFACE: &str = "jaus0";

/// One of the two hosts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Host {
    /// The acting party's.
    Actor,
    /// The answering party's.
    Answerer,
}

impl Host {
    const BOTH: [Self; 2] = [Self::Actor, Self::Answerer];

    /// Its address on the network.
    pub(crate) const fn address(self) -> &'static str {
        match self {
            Self::Actor => "10.215.1.1",
            Self::Answerer => "10.215.1.2",
        }
    }

    /// The switch's end of its cable.
    const fn port(self) -> &'static str {
        match self {
            Self::Actor => "port-actor",
            Self::Answerer => "port-answerer",
        }
    }

    /// An address by which the observer finds the port. Nothing is ever sent to it.
    const fn port_address(self) -> &'static str {
        match self {
            Self::Actor => "10.215.2.1/32",
            Self::Answerer => "10.215.2.2/32",
        }
    }
}

/// The hosts and the switch.
#[derive(Debug)]
pub(crate) struct Hosts {
    prefix: String,
}

impl Hosts {
    /// Creates the hosts and the switch.
    ///
    /// # Errors
    /// If this machine does not permit it.
    pub(crate) fn new() -> Result<Self, String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let hosts = Self {
            prefix: format!("jaus-interop-{}-{number}", std::process::id()),
        };
        hosts.set_up()?;
        Ok(hosts)
    }

    fn set_up(&self) -> Result<(), String> {
        let switch = self.switch();
        ip(&["netns", "add", &switch])?;
        ip(&["-n", &switch, "link", "set", "lo", "up"])?;
        ip(&[
            "-n",
            &switch,
            "link",
            "add",
            "switch",
            "type",
            "bridge",
            "mcast_snooping",
            "0",
        ])?;
        ip(&["-n", &switch, "link", "set", "switch", "up"])?;
        for host in Host::BOTH {
            self.add(host)?;
        }
        Ok(())
    }

    fn add(&self, host: Host) -> Result<(), String> {
        let (name, switch, port) = (self.name(host), self.switch(), host.port());
        ip(&["netns", "add", &name])?;
        ip(&["-n", &name, "link", "set", "lo", "up"])?;
        ip(&[
            "link", "add", port, "netns", &switch, "type", "veth", "peer", INTERFACE, "netns",
            &name,
        ])?;
        ip(&["-n", &switch, "link", "set", port, "master", "switch"])?;
        ip(&[
            "-n",
            &switch,
            "address",
            "add",
            host.port_address(),
            "dev",
            port,
        ])?;
        ip(&["-n", &switch, "link", "set", port, "up"])?;
        let address = format!("{}/24", host.address());
        ip(&[
            "-n", &name, "address", "add", &address, "brd", "+", "dev", INTERFACE,
        ])?;
        ip(&["-n", &name, "link", "set", INTERFACE, "up"])?;
        // For programs that let the system choose the interface.
        ip(&["-n", &name, "route", "add", "224.0.0.0/4", "dev", INTERFACE])
    }

    /// The namespace of a host.
    pub(crate) fn name(&self, host: Host) -> String {
        match host {
            Host::Actor => format!("{}-a", self.prefix),
            Host::Answerer => format!("{}-b", self.prefix),
        }
    }

    /// The namespace of the switch.
    pub(crate) fn switch(&self) -> String {
        format!("{}-s", self.prefix)
    }

    /// The interface on which the observer sees all traffic of the answering host.
    pub(crate) const fn observed() -> &'static str {
        Host::Answerer.port()
    }

    /// Pulls the cable of the answering host, or reconnects it.
    pub(crate) fn cable(&self, is_in: bool) -> Result<(), String> {
        let state = if is_in { "up" } else { "down" };
        let port = Host::Answerer.port();
        ip(&["-n", &self.switch(), "link", "set", port, state])
    }

    /// Kills every process on a host, daemons too.
    pub(crate) fn cut_power(&self, host: Host) {
        kill_all(&self.name(host));
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        let names = [
            self.name(Host::Actor),
            self.name(Host::Answerer),
            self.switch(),
        ];
        for name in &names {
            kill_all(name);
            // Missing if the setup failed halfway.
            let _ = ip(&["netns", "delete", name]);
        }
    }
}

/// Kills all processes of a namespace.
fn kill_all(name: &str) {
    let Ok(output) = Command::new("ip").args(["netns", "pids", name]).output() else {
        return;
    };
    let pids = String::from_utf8_lossy(&output.stdout);
    let pids: Vec<&str> = pids.split_whitespace().collect();
    if !pids.is_empty() {
        // They may have ended meanwhile.
        let _ = Command::new("kill").arg("-9").args(pids).output();
    }
}
