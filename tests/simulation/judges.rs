//! Invariants of every endpoint under all faults: its limits, and silence after all activity.

use jaus::endpoint::Counter;

use crate::nodes::{Nodes, components};
use crate::sim::Host;

/// Number of urgent packets that may exceed the window.
const URGENT: usize = 32;
/// Limit of datagrams per packet of a message or answer, over all attempts and receivers.
const TRIES: u64 = 80;

/// Checks that tables, buffers and windows keep their limits.
pub(crate) fn check_bounds(nodes: &mut Nodes) -> Result<(), String> {
    (0..nodes.len()).try_for_each(|node| check_bounds_of(nodes, node))
}

fn check_bounds_of(nodes: &mut Nodes, node: usize) -> Result<(), String> {
    let count = nodes.len();
    let config = &nodes.plan.nodes[node].config;
    let endpoint = nodes.network.endpoint(Host(node));
    let peers = endpoint.peers().count();
    if peers > config.limits.max_peers {
        return Err(format!("node {node} knows {peers} peers"));
    }
    let unfinished = endpoint.unfinished();
    if unfinished > config.max_reassembly {
        return Err(format!("node {node} keeps {unfinished} octets"));
    }
    for id in (0..count).flat_map(components) {
        let Some(flow) = endpoint.flow(id) else {
            continue;
        };
        if flow.window > config.max_window || flow.in_flight > config.max_window + URGENT {
            return Err(format!("node {node} sends too much at once: {flow:?}"));
        }
    }
    Ok(())
}

/// Checks that the number of datagrams for `packets` packets was reasonable.
pub(crate) fn check_carried(nodes: &Nodes, packets: u64) -> Result<(), String> {
    let links: usize = nodes.plan.nodes.iter().map(|it| it.networks.len()).sum();
    // A router forwards each datagram to all its other links.
    let hops = (1 + links - nodes.len()) as u64;
    let (carried, most) = (nodes.network.carried(), 100 + packets * TRIES * hops);
    if carried > most {
        return Err(format!("{carried} datagrams for {packets} packets"));
    }
    Ok(())
}

/// Checks that nothing is left to send.
pub(crate) fn check_rest(nodes: &mut Nodes) -> Result<(), String> {
    for node in 0..nodes.len() {
        let endpoint = nodes.network.endpoint(Host(node));
        let unfinished = endpoint.unfinished();
        if unfinished > 0 {
            return Err(format!("node {node} keeps {unfinished} octets for ever"));
        }
        let malformed = endpoint.counters().get(Counter::Malformed);
        if malformed > 0 && !nodes.plan.is_corrupting {
            return Err(format!("node {node} got what it cannot read"));
        }
    }
    Ok(())
}
