//! The metrics of a node: its counters, links, peers and attached components.

use std::fmt::Display;
use std::time::Instant;

use jaus::endpoint::{Counter, Peer};
use jaus::node::{LinkReport, Node, TcpReport};

use super::exposition::{Exposition, Unit, Value};

/// Maximum number of peers, links or components with samples of their own. Peers are those known
/// longest, so that new ids, which any sender can invent, replace none.
const MOST: usize = 64;

/// The counters that are one family each: their common beginning, the family, and its description.
const REASONS: [(&str, &str, &str); 3] = [
    (
        "dropped: ",
        "jaus_dropped",
        "Received messages and datagrams that were dropped, by reason.",
    ),
    (
        "not sent: ",
        "jaus_not_sent",
        "Messages and datagrams that were not sent, by reason.",
    ),
    (
        "not forwarded: ",
        "jaus_not_forwarded",
        "Messages for other nodes that were not forwarded, by reason.",
    ),
];

/// Adds all metrics of a node.
pub(super) fn add(exposition: &mut Exposition, node: &Node, now: Instant) {
    let config = node.config();
    let id = format!("{}.{}", config.subsystem, config.node);
    exposition
        .gauge("jaus_node_info", Unit::None, "The id of the node.")
        .add(&[("node", &id)], 1_u64);
    add_counters(exposition, node);
    add_links(exposition, node);
    add_streams(exposition, node);
    add_peers(exposition, node, now);
    add_components(exposition, node);
}

/// The reason in a counter's name, if it is one of a family with this beginning.
fn reason(counter: Counter, beginning: &str) -> Option<&'static str> {
    counter.name().strip_prefix(beginning)
}

fn add_counters(exposition: &mut Exposition, node: &Node) {
    let counters = node.counters();
    for (beginning, name, help) in REASONS {
        let mut family = exposition.counter(name, Unit::None, help);
        for (counter, count) in counters.iter() {
            if let Some(reason) = reason(counter, beginning) {
                family.add(&[("reason", &reason)], count);
            }
        }
    }
    for (counter, count) in counters.iter() {
        if REASONS.iter().any(|(it, ..)| reason(counter, it).is_some()) {
            continue;
        }
        let help = format!("Count of {}.", counter.name());
        exposition
            .counter(&name(counter), Unit::None, &help)
            .add(&[], count);
    }
}

/// The metric of a counter: `jaus_datagrams_received` for `DatagramsReceived`.
fn name(counter: Counter) -> String {
    let mut name = "jaus".to_owned();
    for c in format!("{counter:?}").chars() {
        if c.is_ascii_uppercase() {
            name.push('_');
        }
        name.push(c.to_ascii_lowercase());
    }
    name
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

/// TCP connections and serial lines.
fn add_streams(exposition: &mut Exposition, node: &Node) {
    let tcp: Vec<_> = node.tcp().into_iter().collect();
    let mut connections = exposition.gauge(
        "jaus_tcp_connections",
        Unit::None,
        "Established TCP connections.",
    );
    for tcp in &tcp {
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
    for (name, unit, help, value) in columns {
        let mut family = exposition.counter(name, unit, help);
        for tcp in &tcp {
            family.add(&[], value(tcp));
        }
    }
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

fn add_peers(exposition: &mut Exposition, node: &Node, now: Instant) {
    let mut peers = node.peers();
    let help = "Known peers, including those without samples of their own.";
    exposition
        .gauge("jaus_peers", Unit::None, help)
        .add(&[], peers.len());
    peers.sort_by_key(|peer| (peer.first_heard, peer.id));
    peers.truncate(MOST);
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
    use super::*;
    use crate::metrics::exposition::Format;

    #[tokio::test]
    async fn every_counter_of_the_endpoint_is_exported_once() {
        let node = Node::start(jaus::node::Config::loopback(101, 1)).unwrap();
        let mut exposition = Exposition::new(Format::Prometheus);
        add_counters(&mut exposition, &node);
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
}
