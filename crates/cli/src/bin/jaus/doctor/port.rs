//! Checks whether the ports of a node are free, and which program occupies them.

use std::net::{SocketAddr, TcpListener};
#[cfg(unix)]
use std::path::Path;

#[cfg(unix)]
use jaus::link::junior;
use jaus::link::udp::{PortTaken, Settings, UdpLink};
use jaus::link::{Error, Holder, Interface, Interfaces};
use jaus::node::Config;

use super::finding::Finding;

const CHECK: &str = "port";

/// Opens the sockets of a node on each interface, and closes them again. A program that keeps a port
/// from several sockets is one finding.
pub(super) fn check(config: &Config, interfaces: &[Interface]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for finding in interfaces.iter().flat_map(|it| on_interface(config, it)) {
        if !findings.contains(&finding) {
            findings.push(finding);
        }
    }
    findings
}

fn on_interface(config: &Config, interface: &Interface) -> Vec<Finding> {
    let settings = Settings {
        port: config.port,
        port_taken: PortTaken::Refuse,
        group: config.group,
        group6: config.group6,
        broadcast: config.broadcast,
        ttl: config.ttl,
        receive_buffer: config.receive_buffer,
        ..Settings::default()
    };
    let first = match UdpLink::open(interface, &settings) {
        Ok(link) => return vec![free(config, &link)],
        Err(first) => first,
    };
    let Error::PortTaken { address, holder } = &first else {
        return vec![refused(config, first)];
    };
    // The group may be unreachable too.
    let any = Settings {
        port: 0,
        ..settings
    };
    match UdpLink::open(interface, &any) {
        Ok(_) => vec![refused(config, first)],
        Err(Error::GroupTaken {
            group,
            holder: of_group,
        }) if group.port() == address.port() && of_group == *holder => {
            vec![group_taken(config, group, &of_group)]
        }
        Err(group) => vec![refused(config, first), refused(config, group)],
    }
}

fn free(config: &Config, link: &UdpLink) -> Finding {
    let name = &link.interface().name;
    match config.port {
        0 => Finding::ok(
            CHECK,
            format_args!("any free UDP port will be used on {name}"),
        ),
        _ => Finding::ok(CHECK, format_args!("UDP {} is free", link.local())),
    }
}

fn refused(config: &Config, error: Error) -> Finding {
    match error {
        Error::PortTaken { address, holder } => {
            let what = format!("UDP {address} is taken{holder}");
            if config.port_taken == PortTaken::UseFree {
                return Finding::ok(CHECK, what)
                    .advice("another port will be used (port_taken = \"use-free\")");
            }
            Finding::warning(CHECK, what).advice(
                "harmless if that is your node; a second node on this host needs another port \
                 (--port 3795, or 0 for any free one)",
            )
        }
        Error::GroupTaken { group, holder } => group_taken(config, group, &holder),
        error => Finding::problem(CHECK, error),
    }
}

fn group_taken(config: &Config, group: SocketAddr, holder: &Holder) -> Finding {
    let what = format_args!(
        "the multicast group {group} cannot be received: its port is bound{holder} to all \
         addresses without sharing, as Junior does"
    );
    let as_client = as_client_of_junior(config);
    Finding::problem(CHECK, what).advice(if holder.is_junior() {
        format!("connect through it: {as_client} (junior = \"/tmp\" in a settings file)")
    } else {
        format!(
            "if it is JuniorRTE, connect through it: {as_client}; otherwise stop that program, or \
             run without the group: --group off --port 0, and --peer ADDRESS for each node"
        )
    })
}

/// The flags for a client of Junior's node manager, which uses the manager's network instead of its
/// own.
fn as_client_of_junior(config: &Config) -> &'static str {
    match (&config.interfaces, config.routing.forward) {
        (Interfaces::Loopback, _) => "--junior instead of --loopback",
        (_, true) => "the same flags and --junior, and no routing.forward",
        (_, false) => "the same flags and --junior",
    }
}

/// The same for a client of Junior, which needs Junior's node manager instead of ports.
#[cfg(unix)]
pub(super) fn check_junior(folder: &Path) -> Finding {
    match junior::check(folder) {
        Ok(()) => Finding::ok(
            CHECK,
            format_args!("Junior's node manager is running, at {}", folder.display()),
        ),
        Err(error) => Finding::problem(CHECK, error),
    }
}

/// The same for the TCP listener address, if one is configured.
pub(super) fn check_tcp(config: &Config) -> Option<Finding> {
    let listen = config.tcp.listen?;
    Some(match TcpListener::bind(listen) {
        Ok(_) => Finding::ok(CHECK, format_args!("TCP {listen} is free")),
        Err(error) => Finding::problem(CHECK, format_args!("TCP {listen} is not free: {error}"))
            .advice(format_args!(
                "find the owner with `sudo ss -tlpn 'sport = :{}'`, or choose another port in \
                 tcp.listen",
                listen.port()
            )),
    })
}
