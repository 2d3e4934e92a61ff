//! Prints the counters of a node: all nonzero ones, with reasons.

use std::collections::BTreeMap;

use jaus::counters::Count;
use jaus::endpoint::Counter;
use jaus::node::Node;

use super::failure::Failure;
use super::output::Output;

/// Maximum number of peers that are listed one by one.
const MOST: usize = 20;

/// Prints counters, links, mailboxes and peers.
pub fn print(node: &Node, output: &mut Output) -> Result<(), Failure> {
    output.line("")?;
    for (counter, count) in node.counters().iter().filter(|&(_, count)| count > 0) {
        output.line(format_args!("{count:>9}  {}", counter.name()))?;
    }
    for line in links(node)
        .into_iter()
        .chain(mailboxes(node))
        .chain(peers(node))
    {
        output.line(line)?;
    }
    Ok(())
}

fn links(node: &Node) -> Vec<String> {
    let mut lines = Vec::new();
    for link in node.links() {
        let counters = &link.counters;
        let mut line = format!(
            "link {} {}: in {} datagrams, {} octets; out {}, {}",
            link.interface.name,
            link.local,
            counters.received,
            counters.received_octets,
            counters.sent,
            counters.sent_octets
        );
        for (count, what) in [
            (counters.receive_errors, "receive errors"),
            (counters.send_errors, "send errors"),
            (counters.send_overflows, "dropped: network too slow"),
            (
                link.kernel_drops.unwrap_or(0),
                "dropped by the kernel: read too slowly",
            ),
        ] {
            if count > 0 {
                line.push_str(&format!("; {count} {what}"));
            }
        }
        lines.push(line);
    }
    if let Some(tcp) = node.tcp() {
        lines.push(format!("link tcp: {} connections", tcp.connections.len()));
    }
    for link in node.custom_links() {
        let counted = link.counters.iter().filter(|count| count.value > 0);
        let line =
            |count: &Count| format!("link {}: {} {}", link.name, count.value, count.description);
        lines.extend(counted.map(line));
    }
    lines
}

fn mailboxes(node: &Node) -> Vec<String> {
    let line = |component: jaus::node::ComponentReport| {
        let mailbox = component.mailbox;
        format!(
            "component {}: {} delivered, {} dropped unread, {} queued",
            component.id, mailbox.delivered, mailbox.dropped, mailbox.waiting
        )
    };
    node.components().into_iter().map(line).collect()
}

fn peers(node: &Node) -> Vec<String> {
    let peers = node.peers();
    let mut lines: Vec<String> = peers
        .iter()
        .take(MOST)
        .map(|peer| {
            let round_trip = peer.round_trip.map_or_else(String::new, |time| {
                format!(", round trip {:.2} ms", time.as_secs_f64() * 1e3)
            });
            format!(
                "peer {} at {}: in {}, out {} messages; {} repeated, {} resent, {} lost{round_trip}",
                peer.id,
                peer.path.peer,
                peer.received.messages,
                peer.sent.messages,
                peer.duplicates,
                peer.retransmissions,
                peer.lost
            )
        })
        .collect();
    if peers.len() > MOST {
        lines.push(format!("and {} more peers", peers.len() - MOST));
    }
    lines
}

/// Reports growing drop counters, one line per reason, at the caller's interval, so that a flood
/// cannot fill a log.
#[derive(Default)]
pub struct DropWatch {
    before: BTreeMap<Counter, u64>,
}

impl DropWatch {
    /// Logs the drops since the last call.
    pub fn log(&mut self, node: &Node) {
        for (counter, total) in node.counters().iter() {
            if !counter.name().starts_with("dropped: ") {
                continue;
            }
            let before = self.before.insert(counter, total).unwrap_or(0);
            if total > before {
                let (reason, since) = (counter.name(), total - before);
                tracing::info!(reason, since, total, "messages were dropped");
            }
        }
    }
}
