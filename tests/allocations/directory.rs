//! Memory cost of each further component of a node, in virtual time.

use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::time::Duration;

use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};

use super::{ALLOCATOR, ALONE};

/// Long enough for the discovery among new components to end.
const SETTLED: Duration = Duration::from_secs(4);

/// Limit of an idle component's memory, in octets.
const MOST: usize = 11 * 1024;

/// Allocated octets in use.
fn in_use() -> usize {
    let stats = ALLOCATOR.stats();
    stats.bytes_allocated - stats.bytes_deallocated
}

fn attach(node: &Node, numbers: RangeInclusive<u8>) -> impl Iterator<Item = Component> {
    numbers.map(|number| {
        let builder = Component::builder(Kind::Vehicle, format!("Component {number}"));
        builder.attach(node, number).unwrap()
    })
}

#[tokio::test(start_paused = true)]
async fn a_further_component_costs_at_most_11_kib_however_many_there_are() {
    let _alone = ALONE.lock().await;
    // A link without traffic.
    let listener = SocketAddr::from(([127, 0, 0, 1], 0));
    let config = Config::new(101, 1).without_udp().tcp_listen(listener);
    let node = Node::start(config).unwrap();
    let mut components: Vec<_> = attach(&node, 1..=50).collect();
    let mut costs = Vec::new();
    for numbers in [51..=150, 151..=250] {
        tokio::time::sleep(SETTLED).await;
        let before = in_use();
        components.extend(attach(&node, numbers));
        tokio::time::sleep(SETTLED).await;
        costs.push(in_use().saturating_sub(before) / 100);
    }
    println!("{costs:?} octets for each further component");
    assert!(costs.iter().all(|&cost| cost <= MOST), "{costs:?}");
    for component in &components {
        assert_eq!(component.directory().len(), 250);
    }
    node.shutdown().await;
}
