//! Checks whether the ports of a node are free, and which program occupies them.

use std::net::TcpListener;
#[cfg(unix)]
use std::path::Path;

#[cfg(unix)]
use jaus::link::junior;
use jaus::link::udp::{PortTaken, Settings, UdpLink};
use jaus::link::{Error, Interface};
use jaus::node::Config;

use super::finding::Finding;

const CHECK: &str = "port";

/// Opens the sockets of a node on the interface, and closes them again.
pub(super) fn check(config: &Config, interface: &Interface) -> Vec<Finding> {
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
    let first = UdpLink::open(interface, &settings);
    let Err(Error::PortTaken { .. }) = &first else {
        return vec![judge(config, interface, first)];
    };
    // The group may be unreachable too.
    let any = Settings {
        port: 0,
        ..settings
    };
    let group = UdpLink::open(interface, &any).err();
    let group = group.map(|error| judge(config, interface, Err(error)));
    [judge(config, interface, first)]
        .into_iter()
        .chain(group)
        .collect()
}

fn judge(config: &Config, interface: &Interface, opened: Result<UdpLink, Error>) -> Finding {
    match opened {
        Ok(_) if config.port == 0 => Finding::ok(
            CHECK,
            format_args!("any free UDP port will be used on {}", interface.name),
        ),
        Ok(link) => Finding::ok(CHECK, format_args!("UDP {} is free", link.local())),
        Err(Error::PortTaken { address, holder }) => {
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
        Err(Error::GroupTaken { group, holder }) => Finding::problem(
            CHECK,
            format_args!(
                "the multicast group {group} cannot be received: its port is bound{holder} to all \
                 addresses without sharing, as Junior does"
            ),
        )
        .advice(if holder.is_junior() {
            "connect through it: the same flags and --junior (junior = \"/tmp\" in a settings file)"
        } else {
            "if it is JuniorRTE, connect through it with --junior; otherwise stop that program, \
             or run without the group: --group off --port 0, and --peer ADDRESS for each node"
        }),
        Err(error) => Finding::problem(CHECK, error),
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
