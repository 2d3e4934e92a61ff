//! Checks on the network: whether multicast returns, which peers are present, and duplicate ids.

use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Directory, Kind};
use jaus::endpoint::{Event, Path, Peer};
use jaus::link::interface;
use jaus::node::{Config, Events, LinkReport, Node};
use jaus::wire::Version;
use jaus_cli::runtime;

use super::finding::Finding;
use super::ra::RaSystems;

/// Maximum number of peers that are named one by one.
const MOST: usize = 12;

/// Runs a node with the settings, but with a temporary id and, if necessary, another port. `wanted`
/// is the intended id of the node.
pub(super) async fn look(config: Config, wanted: Option<JausId>, time: Duration) -> Vec<Finding> {
    const CHECK: &str = "network";
    let node = match Node::start(config.clone().or_any_free_port()) {
        Ok(node) => node,
        Err(error) => return vec![Finding::problem(CHECK, error)],
    };
    let mut events = node.events();
    let mut ra = RaSystems::open(&config);
    let started = Component::builder(Kind::OtherSubsystem, "jaus doctor").attach(&node, 1);
    let component = match started {
        Ok(component) => component,
        Err(error) => return vec![Finding::problem(CHECK, error)],
    };
    let mut moved = BTreeMap::new();
    tokio::select! {
        () = runtime::end(Some(time)) => {}
        () = watch(&mut events, &mut moved) => {}
        () = ra.listen() => {}
    }
    let own = component.id();
    let (directory, peers, links) = (component.directory(), node.peers(), node.links());
    drop(component);
    node.shutdown().await;
    let peers: Vec<Peer> = peers.into_iter().filter(|peer| peer.id != own).collect();
    let mut findings: Vec<Finding> = links.iter().filter_map(came_back).collect();
    let of_ra: Vec<Finding> = ra.findings().collect();
    if of_ra.is_empty() || !peers.is_empty() {
        findings.extend(who(&peers, &directory));
    }
    findings.extend(of_ra);
    findings.extend(moved.iter().map(|(&id, places)| two_of(id, places)));
    findings.extend(wanted.map(|id| is_free(id, &peers)));
    findings
}

/// Records ids received from more than one address.
async fn watch(events: &mut Events, moved: &mut BTreeMap<JausId, BTreeSet<Path>>) {
    while let Some(event) = events.recv().await {
        if let Event::PeerMoved { id, from, to } = event {
            moved.entry(id).or_default().extend([from, to]);
        }
    }
}

/// Checks whether our multicasts return on their own link.
fn came_back(link: &LinkReport) -> Option<Finding> {
    const CHECK: &str = "multicast";
    let group = link.group?;
    let name = &link.interface.name;
    if link.counters.own_echo > 0 {
        return Some(Finding::ok(
            CHECK,
            format_args!("multicast to {group} on {name} loops back"),
        ));
    }
    let refused = match link.counters.send_errors {
        0 => String::new(),
        errors => format!(" (the host refused to send {errors} times)"),
    };
    let what = format!("multicast to {group} on {name} does not loop back{refused}");
    Some(Finding::problem(CHECK, what).advice(
        "likely a firewall, or a container without multicast: allow UDP to and from the group \
         (`sudo nft list ruleset`, `sudo iptables -S`), or name the other nodes with --peer",
    ))
}

fn who(peers: &[Peer], directory: &Directory) -> Vec<Finding> {
    const CHECK: &str = "neighbours";
    if peers.is_empty() {
        return vec![Finding::ok(CHECK, "no other node was found").advice(
            "if a node should be there: is it on the same network and group, does its firewall \
             accept UDP 3794, does the switch or access point forward multicast (IGMP snooping \
             without a querier does not)? `jaus examine ADDRESS` examines one host, even \
             one that answers no multicast (Junior)",
        )];
    }
    let one = |peer: &Peer| {
        let name = directory
            .subsystem(peer.id.subsystem())
            .and_then(|subsystem| subsystem.identification())
            .map_or_else(String::new, |told| format!(" of \"{}\"", told.name));
        let old = match peer.version {
            Version::As5669a => "",
            Version::As5669 => ", uses the older AS5669",
            Version::Ra => ", uses the old Reference Architecture",
        };
        Finding::ok(
            CHECK,
            format_args!("{}{name} is at {}{old}", peer.id, peer.path.peer),
        )
    };
    let mut findings: Vec<Finding> = peers.iter().take(MOST).map(one).collect();
    if let Some(more) = peers.len().checked_sub(MOST).filter(|&more| more > 0) {
        let words = format!("{more} more were found; `jaus discover` lists them");
        findings.push(Finding::ok(CHECK, words));
    }
    findings
}

/// One id at several addresses: a conflict on one network, possibly a single node on several
/// networks.
fn two_of(id: JausId, places: &BTreeSet<Path>) -> Finding {
    const CHECK: &str = "ids";
    let named: Vec<String> = places.iter().map(|path| path.peer.to_string()).collect();
    let what = format!("{id} sends from {}", named.join(" and from "));
    let links: BTreeSet<_> = places.iter().map(|path| path.link).collect();
    if links.len() < places.len() {
        return Finding::problem(CHECK, what)
            .advice("two nodes have this id, so answers go astray: give one of them another id");
    }
    Finding::warning(CHECK, what).advice(
        "harmless if that is one node on two networks; if they are two nodes, give one another id",
    )
}

/// Checks whether another node already uses the intended id.
fn is_free(id: JausId, peers: &[Peer]) -> Finding {
    const CHECK: &str = "ids";
    let Some(peer) = peers.iter().find(|peer| peer.id == id) else {
        return Finding::ok(CHECK, format_args!("no other node has the id {id}"));
    };
    let place = peer.path.peer;
    let here = interface::list().unwrap_or_default();
    let is_here = |ip| here.iter().any(|interface| interface.address == ip);
    if place.socket().is_some_and(|address| is_here(address.ip())) {
        return Finding::warning(CHECK, format_args!("{id} runs on this host, at {place}"))
            .advice("harmless if that is your node; a second one needs another id");
    }
    Finding::problem(CHECK, format_args!("{id} is taken by {place}"))
        .advice("choose another id (--id), or stop the other node")
}
