//! The peers that were heard: who and where they are, and whether both sides can reach each other.

use std::net::SocketAddr;

use ipnet::IpNet;
use jaus::endpoint::{Peer, RouteState};
use jaus::link::{Interface, interface};
use jaus::wire::Version;

use super::finding::Finding;
use super::heard::{Heard, node_of};

const CHECK: &str = "neighbours";

/// Maximum number of peers that are named one by one.
const MOST: usize = 12;

/// The findings about all peers.
pub(super) fn findings(heard: &Heard) -> Vec<Finding> {
    if heard.peers.is_empty() && heard.of_ra.is_empty() {
        return vec![alone(heard)];
    }
    let here = interface::list().unwrap_or_default();
    let (mut warnings, mut others) = (Vec::new(), Vec::new());
    for peer in &heard.peers {
        match out_of_reach(heard, peer, &here) {
            Some(warning) => warnings.push(warning),
            None => others.push(present(heard, peer)),
        }
    }
    // Warnings first, so that a large fleet does not hide them.
    let mut findings: Vec<Finding> = warnings.into_iter().chain(others).collect();
    let more = findings.len().saturating_sub(MOST);
    findings.truncate(MOST);
    if more > 0 {
        let words = format!("{more} more were found; `jaus discover` lists them");
        findings.push(Finding::ok(CHECK, words));
    }
    findings.extend(heard.of_ra.iter().cloned());
    findings
}

/// The warning that no other node was found.
fn alone(heard: &Heard) -> Finding {
    let seconds = heard.listened.as_secs_f64();
    Finding::alone(
        CHECK,
        format_args!("no other node was heard in {seconds} s"),
    )
    .advice(
        "if a node should be there: does it run, is it on the same network and group, does its \
         firewall accept UDP 3794, does the switch or access point forward multicast (IGMP \
         snooping without a querier does not)? Run `jaus doctor` there too; `jaus examine \
         ADDRESS` examines one host, even one that answers no multicast (Junior)",
    )
}

/// A peer's id and the name of its subsystem.
fn named(heard: &Heard, peer: &Peer) -> String {
    let subsystem = heard.directory.subsystem(peer.id.subsystem());
    let identification = subsystem.and_then(|subsystem| subsystem.identification());
    // Quoted, so that control characters are escaped.
    let name = identification.map_or_else(String::new, |it| format!(" of {:?}", it.name));
    format!("{}{name}", peer.id)
}

fn present(heard: &Heard, peer: &Peer) -> Finding {
    let old = match peer.version {
        Version::As5669a => "",
        Version::As5669 => ", uses the older AS5669",
        Version::Ra => ", uses the old Reference Architecture",
    };
    let (name, place) = (named(heard, peer), peer.path.peer);
    Finding::ok(CHECK, format_args!("{name} is at {place}{old}"))
}

/// The warning about a peer that only one side can reach.
fn out_of_reach(heard: &Heard, peer: &Peer, here: &[Interface]) -> Option<Finding> {
    let address = peer.path.peer.socket()?;
    let mut links = heard.links.iter();
    let link = links.find(|link| link.link == peer.path.link)?;
    let name = named(heard, peer);
    let is_reached = |it: &Interface| it.index == link.interface.index && it.reaches(address);
    // A peer that has acknowledged a message is reached, for instance through a router.
    if peer.route != RouteState::Verified && !here.iter().any(is_reached) {
        return Some(elsewhere(&name, address, &link.interface));
    }
    if !heard.mute.contains(&node_of(peer.id)) {
        return None;
    }
    let seconds = heard.listened.as_secs_f64();
    let (ip, interface) = (address.ip(), &link.interface.name);
    let what = format_args!(
        "{name} is at {address}, but none of its multicasts arrived on {interface} in {seconds} s"
    );
    Some(Finding::warning(CHECK, what).advice(format_args!(
        "nodes here find it only if it hears them first. On its host, does a firewall drop \
         outgoing multicast (`nft list ruleset`), and does multicast leave through the right \
         interface (`jaus doctor` there)? Does the switch or access point forward multicast? \
         Without multicast, name it: --peer {ip}"
    )))
}

/// A peer whose address is in no network of the interface that received its messages.
fn elsewhere(name: &str, address: SocketAddr, interface: &Interface) -> Finding {
    let ip = address.ip();
    let ours = network(interface);
    let theirs = network(&Interface {
        address: ip,
        ..interface.clone()
    });
    let device = &interface.name;
    let what = format_args!(
        "{name} at {address} is heard on {device}, but is not in its network {ours}: it is in \
         another one, such as {theirs}, so messages to it may not arrive"
    );
    Finding::warning(CHECK, what).advice(format_args!(
        "give both hosts addresses of one network: its host one in {ours}, or this host one in \
         {theirs} (`ip address add`). If a router connects the two networks, `jaus examine {ip}` \
         shows whether it is reached"
    ))
}

/// The network of an interface, such as `10.0.0.0/24`.
fn network(interface: &Interface) -> String {
    let network = IpNet::new(interface.address, interface.prefix).map(|it| it.trunc());
    network.map_or_else(|_| interface.address.to_string(), |it| it.to_string())
}
