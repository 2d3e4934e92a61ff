//! The metrics of a node: its counters, links, peers and attached components.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::{Duration, Instant};

use jaus::endpoint::Peer;
#[cfg(unix)]
use jaus::node::JuniorReport;
use jaus::node::{LinkReport, Node, TcpReport};
use jaus_limits::fair_selection;

use super::counts;
use super::exposition::{Exposition, Unit, Value};

/// Maximum number of peers, links or components with samples of their own. Peers are chosen evenly from
/// all network addresses, and of each address those known longest: ids that a sender invents replace
/// none of other hosts.
const MOST: usize = 64;
/// A peer that is silent for this time leaves its place to others.
const SILENCE: Duration = Duration::from_secs(60);

/// Adds all metrics of a node.
pub(super) fn add(exposition: &mut Exposition, node: &Node, now: Instant) {
    let config = node.config();
    let id = format!("{}.{}", config.subsystem, config.node);
    exposition
        .gauge("jaus_node_info", Unit::None, "The id of the node.")
        .add(&[("node", &id)], 1_u64);
    counts::add(exposition, "jaus", node.counters().counts());
    add_links(exposition, node);
    add_tcp(exposition, node);
    add_serial_lines(exposition, node);
    #[cfg(unix)]
    add_junior(exposition, node.junior().as_ref());
    add_custom_links(exposition, node);
    add_peers(exposition, node, now);
    add_components(exposition, node);
}

/// A metric of each item of a list: name, unit, description, value.
type Column<T, V> = (&'static str, Unit, &'static str, fn(&T) -> V);

/// One counter for each column, with a sample for each item.
fn add_table<T>(
    exposition: &mut Exposition,
    items: &[T],
    label: &'static str,
    key: impl Fn(&T) -> String,
    columns: &[Column<T, u64>],
) {
    for (name, unit, help, value) in columns {
        let mut family = exposition.counter(name, *unit, help);
        for item in items.iter().take(MOST) {
            family.add(&[(label, &key(item))], value(item));
        }
    }
}

fn add_links(exposition: &mut Exposition, node: &Node) {
    let links = node.links();
    let key = |link: &LinkReport| format!("{} {}", link.interface.name, link.local);
    add_table(
        exposition,
        &links,
        "link",
        key,
        &[
            (
                "jaus_link_received_datagrams",
                Unit::None,
                "Datagrams received on a UDP link.",
                |link| link.counters.received,
            ),
            (
                "jaus_link_received",
                Unit::Bytes,
                "Octets received on a UDP link.",
                |link| link.counters.received_octets,
            ),
            (
                "jaus_link_sent_datagrams",
                Unit::None,
                "Datagrams sent on a UDP link.",
                |link| link.counters.sent,
            ),
            (
                "jaus_link_sent",
                Unit::Bytes,
                "Octets sent on a UDP link.",
                |link| link.counters.sent_octets,
            ),
        ],
    );
    let help = "Datagrams that a UDP link lost, by cause.";
    let mut errors = exposition.counter("jaus_link_errors", Unit::None, help);
    for link in links.iter().take(MOST) {
        for (cause, count) in [
            ("receive", link.counters.receive_errors),
            ("send", link.counters.send_errors),
            ("send queue full", link.counters.send_overflows),
            ("receive buffer full", link.kernel_drops.unwrap_or(0)),
        ] {
            errors.add(&[("link", &key(link)), ("cause", &cause)], count);
        }
    }
}

/// One counter for each column, with a sample if the only link of its kind is there.
fn add_columns<T>(exposition: &mut Exposition, link: Option<&T>, columns: &[Column<T, u64>]) {
    for (name, unit, help, value) in columns {
        let mut family = exposition.counter(name, *unit, help);
        if let Some(link) = link {
            family.add(&[], value(link));
        }
    }
}

fn add_tcp(exposition: &mut Exposition, node: &Node) {
    let tcp = node.tcp();
    let mut connections = exposition.gauge(
        "jaus_tcp_connections",
        Unit::None,
        "Established TCP connections.",
    );
    if let Some(tcp) = &tcp {
        connections.add(&[], tcp.connections.len());
    }
    let columns: [Column<TcpReport, u64>; 4] = [
        (
            "jaus_tcp_received_messages",
            Unit::None,
            "Messages received on TCP connections.",
            |it| it.counters.received,
        ),
        (
            "jaus_tcp_sent_messages",
            Unit::None,
            "Messages sent on TCP connections.",
            |it| it.counters.sent,
        ),
        (
            "jaus_tcp_dropped_messages",
            Unit::None,
            "Messages that no TCP connection took.",
            |it| it.counters.send_overflows + it.counters.not_connected + it.counters.other_version,
        ),
        (
            "jaus_tcp_refused_connections",
            Unit::None,
            "TCP connections that were refused.",
            |it| it.counters.refused + it.counters.denied,
        ),
    ];
    add_columns(exposition, tcp.as_ref(), &columns);
}

fn add_serial_lines(exposition: &mut Exposition, node: &Node) {
    let lines = node.serial_lines();
    let help = "Whether the port of a serial line is open (1) or not (0).";
    let mut open = exposition.gauge("jaus_serial_open", Unit::None, help);
    for line in lines.iter().take(MOST) {
        open.add(&[("device", &line.settings.device)], line.is_open);
    }
    add_table(
        exposition,
        &lines,
        "device",
        |line| line.settings.device.clone(),
        &[
            (
                "jaus_serial_received_packets",
                Unit::None,
                "Valid packets received on a serial line.",
                |line| line.counters.received.packets,
            ),
            (
                "jaus_serial_sent_packets",
                Unit::None,
                "Packets sent on a serial line.",
                |line| line.counters.sent,
            ),
            (
                "jaus_serial_dropped_packets",
                Unit::None,
                "Packets that a serial line did not take.",
                |line| line.counters.send_overflows + line.counters.port_away,
            ),
        ],
    );
}

/// The link through Junior's node manager.
#[cfg(unix)]
fn add_junior(exposition: &mut Exposition, junior: Option<&JuniorReport>) {
    let help = "Whether Junior's node manager has accepted all components (1) or not (0).";
    let mut registered = exposition.gauge("jaus_junior_registered", Unit::None, help);
    if let Some(junior) = junior {
        registered.add(&[], junior.is_registered);
    }
    let columns: [Column<JuniorReport, u64>; 4] = [
        (
            "jaus_junior_received_datagrams",
            Unit::None,
            "Datagrams received through Junior's node manager.",
            |it| it.counters.received,
        ),
        (
            "jaus_junior_sent_datagrams",
            Unit::None,
            "Datagrams passed to Junior's node manager.",
            |it| it.counters.sent,
        ),
        (
            "jaus_junior_registrations",
            Unit::None,
            "How often Junior's node manager has accepted a component.",
            |it| it.counters.registrations,
        ),
        (
            "jaus_junior_failures",
            Unit::None,
            "How often Junior's node manager went away.",
            |it| it.counters.failures,
        ),
    ];
    add_columns(exposition, junior, &columns);
    let help = "Datagrams that the link through Junior's node manager lost, by cause.";
    let mut errors = exposition.counter("jaus_junior_errors", Unit::None, help);
    for counters in junior.iter().map(|it| it.counters) {
        for (cause, count) in [
            ("receive", counters.receive_errors),
            ("send", counters.send_errors),
            ("send queue full", counters.send_overflows),
            ("node manager away", counters.manager_away),
        ] {
            errors.add(&[("cause", &cause)], count);
        }
    }
}

/// The links of other crates. Those of the same name are added together.
fn add_custom_links(exposition: &mut Exposition, node: &Node) {
    let mut links = BTreeMap::<_, Vec<_>>::new();
    for link in node.custom_links() {
        let counts = links.entry(counts::snake_case(&link.name)).or_default();
        counts.extend(link.counters);
    }
    for (name, counts) in links.into_iter().take(MOST) {
        counts::add(exposition, &format!("jaus_{name}"), counts);
    }
}

fn add_peers(exposition: &mut Exposition, node: &Node, now: Instant) {
    let mut peers = node.peers();
    let help = "Known peers, including those without samples of their own.";
    exposition
        .gauge("jaus_peers", Unit::None, help)
        .add(&[], peers.len());
    peers.retain(|peer| now.saturating_duration_since(peer.last_heard) < SILENCE);
    let peers = with_samples(peers);
    add_table(
        exposition,
        &peers,
        "peer",
        |peer| peer.id.to_string(),
        &[
            (
                "jaus_peer_received_messages",
                Unit::None,
                "Messages received from a peer.",
                |peer| peer.received.messages,
            ),
            (
                "jaus_peer_received",
                Unit::Bytes,
                "Octets of payload received from a peer.",
                |peer| peer.received.octets,
            ),
            (
                "jaus_peer_sent_messages",
                Unit::None,
                "Messages sent to a peer alone.",
                |peer| peer.sent.messages,
            ),
            (
                "jaus_peer_sent",
                Unit::Bytes,
                "Octets of payload sent to a peer alone.",
                |peer| peer.sent.octets,
            ),
            (
                "jaus_peer_duplicates",
                Unit::None,
                "Duplicates received from a peer.",
                |peer| peer.duplicates,
            ),
            (
                "jaus_peer_retransmissions",
                Unit::None,
                "Retransmissions to a peer, because no acknowledgement arrived.",
                |peer| peer.retransmissions,
            ),
            (
                "jaus_peer_lost_messages",
                Unit::None,
                "Messages to a peer given up, because no acknowledgement arrived.",
                |peer| peer.lost,
            ),
        ],
    );
    let help = "Smoothed round trip to a peer, from transmission to acknowledgement.";
    add_times(exposition, "jaus_peer_round_trip", help, &peers, |peer| {
        Some(peer.round_trip?.as_secs_f64())
    });
    let help = "Time since the latest message of a peer.";
    add_times(exposition, "jaus_peer_silence", help, &peers, |peer| {
        let silence = now.saturating_duration_since(peer.last_heard);
        Some(silence.as_secs_f64())
    });
}

/// The peers with samples of their own.
fn with_samples(mut peers: Vec<Peer>) -> Vec<Peer> {
    peers.sort_by_key(|peer| (peer.first_heard, peer.id));
    fair_selection(peers, MOST, |peer| peer.path.peer.origin())
}

fn add_times(
    exposition: &mut Exposition,
    name: &str,
    help: &str,
    peers: &[Peer],
    time: impl Fn(&Peer) -> Option<f64>,
) {
    let mut family = exposition.gauge(name, Unit::Seconds, help);
    for peer in peers {
        if let Some(time) = time(peer) {
            family.add(&[("peer", &peer.id)], time);
        }
    }
}

fn add_components(exposition: &mut Exposition, node: &Node) {
    let components = node.components();
    add_table(
        exposition,
        &components,
        "component",
        |it| it.id.to_string(),
        &[
            (
                "jaus_component_delivered_messages",
                Unit::None,
                "Messages put into the mailbox of an attached component.",
                |it| it.mailbox.delivered,
            ),
            (
                "jaus_component_dropped_messages",
                Unit::None,
                "Messages that an attached component did not read in time.",
                |it| it.mailbox.dropped,
            ),
        ],
    );
    let help = "Messages in the mailbox of an attached component.";
    let mut queued = exposition.gauge("jaus_component_queued_messages", Unit::None, help);
    for component in components.iter().take(MOST) {
        let id: &dyn Display = &component.id;
        let waiting: Value = component.mailbox.waiting.into();
        queued.add(&[("component", id)], waiting);
    }
}

#[cfg(test)]
mod tests {
    use jaus::address::JausId;
    use jaus::component::{Component, Kind};
    use jaus::endpoint::{Counter, Remote};
    use jaus::node::{Config, now};
    use jaus_test_kit::group::own_group;
    use jaus_test_kit::waiting::until;

    use super::*;
    use crate::metrics::exposition::Format;

    #[tokio::test]
    async fn every_counter_of_the_endpoint_is_exported_once() {
        let node = Node::start(Config::loopback(101, 1)).unwrap();
        let mut exposition = Exposition::new(Format::Prometheus);
        counts::add(&mut exposition, "jaus", node.counters().counts());
        let text = exposition.finish();
        let samples: Vec<_> = text.lines().filter(|it| !it.starts_with('#')).collect();
        assert_eq!(samples.len(), Counter::ALL.len(), "{text}");
        for expected in [
            "jaus_datagrams_received_total 0",
            "jaus_dropped_total{reason=\"malformed\"} 0",
            "jaus_not_sent_total{reason=\"the link is gone\"} 0",
        ] {
            assert!(samples.contains(&expected), "{expected}: {text}");
        }
        node.shutdown().await;
    }

    #[tokio::test]
    async fn a_silent_peer_leaves_its_place_to_others() {
        let group = own_group();
        let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
        let (node, other) = (start(101), start(102));
        let rover = || Component::builder(Kind::Vehicle, "Rover");
        let _rovers = [&node, &other].map(|it| rover().attach(it, 1).unwrap());
        until(|| !node.peers().is_empty()).await;
        let has_samples = |after: Duration| {
            let mut exposition = Exposition::new(Format::Prometheus);
            add_peers(&mut exposition, &node, now() + after);
            exposition.finish().contains("{peer=\"102.1.1\"}")
        };
        assert!(has_samples(Duration::ZERO));
        assert!(!has_samples(2 * SILENCE));
    }

    #[tokio::test]
    async fn ids_that_a_host_invents_take_no_place_of_another_host() {
        let group = own_group();
        let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
        let (node, other) = (start(101), start(102));
        let rover = || Component::builder(Kind::Vehicle, "Rover");
        let _rovers = [&node, &other].map(|it| rover().attach(it, 1).unwrap());
        until(|| !node.peers().is_empty()).await;
        let known = node.peers()[0];
        let peer = |number: u16, host: [u8; 4]| {
            let mut peer = known;
            peer.id = JausId::new(number, 1, 1);
            peer.path.peer = Remote::Socket((host, number).into());
            peer
        };
        let flood = (1..=1000).map(|number| peer(number, [10, 0, 0, 66]));
        // The youngest, with the greatest id.
        let mut vehicle = peer(2000, [10, 0, 0, 1]);
        vehicle.first_heard += Duration::from_secs(10);
        let shown = with_samples(flood.chain([vehicle]).collect());
        assert_eq!(shown.len(), MOST);
        assert!(shown.iter().any(|peer| peer.id == vehicle.id));
    }

    #[cfg(unix)]
    #[test]
    fn losses_of_the_link_through_junior_have_their_causes() {
        let counters = jaus::link::junior::Counters {
            manager_away: 3,
            failures: 1,
            ..Default::default()
        };
        let junior = JuniorReport {
            link: jaus::endpoint::LinkId(0),
            folder: "/tmp".into(),
            is_registered: false,
            counters,
        };
        let mut exposition = Exposition::new(Format::Prometheus);
        add_junior(&mut exposition, Some(&junior));
        let text = exposition.finish();
        for expected in [
            "jaus_junior_registered 0",
            "jaus_junior_failures_total 1",
            "jaus_junior_errors_total{cause=\"node manager away\"} 3",
            "jaus_junior_errors_total{cause=\"send\"} 0",
        ] {
            assert!(text.lines().any(|it| it == expected), "{expected}: {text}");
        }
    }
}
