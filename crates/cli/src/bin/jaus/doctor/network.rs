//! Checks on the network: runs a node, listens, and reports whether multicast returns, which peers
//! are present, and duplicate ids.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{AttachError, Component, Kind};
use jaus::endpoint::{Event, Path, Peer};
use jaus::link::interface;
use jaus::link::udp::Settings;
use jaus::node::{Config, Events, LinkReport, Node, StartError};
use jaus::wire::Version;
use jaus_cli::output::say;
use jaus_cli::runtime;

use super::finding::{Finding, Mark};
use super::group::GroupLinks;
use super::heard::{Heard, NodeId, node_of};
use super::neighbours;
use super::ra::RaSystems;

/// Runs a node with the settings, but with a temporary id and, if necessary, another port. `wanted`
/// is the intended id of the node; `before` are the findings so far.
pub(super) async fn look(
    config: Config,
    wanted: Option<JausId>,
    time: Duration,
    before: &[Finding],
) -> Vec<Finding> {
    const CHECK: &str = "network";
    let node = match Node::start(config.clone().or_any_free_port()) {
        Ok(node) => node,
        // The checks of the interfaces and ports have opened the same sockets.
        Err(StartError::Link(_)) if before.iter().any(|it| it.mark == Mark::Problem) => {
            say("no node can start here, so the network is not checked");
            return Vec::new();
        }
        Err(error) => return vec![Finding::problem(CHECK, error)],
    };
    let heard = match listen(node, &config, time).await {
        Ok(heard) => heard,
        Err(error) => return vec![Finding::problem(CHECK, error)],
    };
    let mut findings: Vec<Finding> = heard.links.iter().filter_map(came_back).collect();
    findings.extend(neighbours::findings(&heard));
    findings.extend(heard.moved.iter().map(|(&id, places)| two_of(id, places)));
    findings.extend(wanted.map(|id| is_free(id, &heard.peers)));
    findings
}

/// Longest time to wait for the multicasts of a node whose other messages arrive.
const LONGEST: Duration = Duration::from_secs(30);

/// The time within which each node multicasts: nodes of this stack and of JAUS++ call every 5 s,
/// ours less often if more than two other components are there.
fn call_interval(components: usize) -> Duration {
    const CALL: Duration = Duration::from_secs(5);
    const PER_COMPONENT: Duration = Duration::from_millis(1500);
    let spread = PER_COMPONENT.mul_f64(components as f64 + 1.0);
    CALL.max(spread).mul_f64(1.3)
}

/// What is received beside the node's own component.
struct Listener {
    events: Events,
    ra: RaSystems,
    group: GroupLinks,
    /// Ids received from more than one address.
    moved: BTreeMap<JausId, BTreeSet<Path>>,
}

impl Listener {
    fn new(node: &Node, config: &Config) -> Self {
        let groups = Settings {
            group: config.group,
            group6: config.group6,
            broadcast: config.broadcast,
            ..Settings::default()
        };
        Self {
            events: node.events(),
            ra: RaSystems::open(config),
            group: GroupLinks::open(config, &groups),
            moved: BTreeMap::new(),
        }
    }

    /// Listens for a time. Passes the sender of each multicast to `note`, until that returns false.
    async fn listen(&mut self, time: Duration, mut note: impl FnMut(NodeId) -> bool) {
        tokio::select! {
            () = runtime::end(Some(time)) => {}
            () = watch(&mut self.events, &mut self.moved) => {}
            () = self.ra.listen() => {}
            () = self.group.listen(|_, frame| note(node_of(frame.source))) => {}
        }
    }
}

/// Records ids received from more than one address.
async fn watch(events: &mut Events, moved: &mut BTreeMap<JausId, BTreeSet<Path>>) {
    while let Some(event) = events.recv().await {
        if let Event::PeerMoved { id, from, to } = event {
            moved.entry(id).or_default().extend([from, to]);
        }
    }
}

/// Listens for a time, and then for the multicasts of nodes that were heard, but not by multicast.
async fn listen(node: Node, config: &Config, time: Duration) -> Result<Heard, AttachError> {
    let mut listener = Listener::new(&node, config);
    let component = Component::builder(Kind::OtherSubsystem, "jaus doctor").attach(&node, 1)?;
    let own = component.id();
    let others = || node.peers().into_iter().filter(|peer| peer.id != own);
    let mut by_multicast = BTreeSet::new();
    let note = |id| {
        by_multicast.insert(id);
        true
    };
    listener.listen(time, note).await;
    let interval = call_interval(others().count());
    let expected = others().filter(|peer| is_to_multicast(peer, config, &node.links()));
    let expected = expected.map(|peer| node_of(peer.id));
    let mut mute: BTreeSet<NodeId> = expected.filter(|id| !by_multicast.contains(id)).collect();
    if interval > LONGEST {
        mute.clear();
    }
    let mut listened = time;
    if !mute.is_empty() && interval > time {
        listened = interval;
        let note = |id| {
            mute.remove(&id);
            !mute.is_empty()
        };
        listener.listen(interval - time, note).await;
    }
    let heard = Heard {
        peers: others().collect(),
        directory: component.directory(),
        links: node.links(),
        mute,
        listened,
        moved: listener.moved,
        of_ra: listener.ra.findings().collect(),
    };
    drop(component);
    node.shutdown().await;
    Ok(heard)
}

/// Whether a peer's multicasts should arrive: it speaks AS5669A, its messages arrive on a link with
/// a group, and the settings do not name it as a peer that multicast does not reach.
fn is_to_multicast(peer: &Peer, config: &Config, links: &[LinkReport]) -> bool {
    let has_group = |link: &LinkReport| link.link == peer.path.link && link.group.is_some();
    let address = peer.path.peer.socket();
    let is_named = |ip| config.peers.iter().any(|named| named.address().ip() == ip);
    peer.version == Version::As5669a
        && links.iter().any(has_group)
        && address.is_some_and(|address| !is_named(address.ip()))
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
