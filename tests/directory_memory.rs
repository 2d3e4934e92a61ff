//! Memory cost of each further component of a node.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a test with sockets"
)]

use std::time::Duration;

use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;

/// What this process holds in memory, in octets.
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().nth(1));
    1024 * kib.unwrap().parse::<usize>().unwrap()
}

async fn attach(node: &Node, numbers: std::ops::RangeInclusive<u8>) -> Vec<Component> {
    let attach = |number| {
        let builder = Component::builder(Kind::Vehicle, format!("Component {number}"));
        builder.attach(node, number).unwrap()
    };
    let components: Vec<_> = numbers.map(attach).collect();
    let all = components.last().unwrap().directory().len();
    for component in &components {
        while component.directory().len() < all {
            tokio::task::yield_now().await;
        }
    }
    components
}

#[tokio::test]
async fn a_further_component_costs_no_more_however_many_there_are() {
    let node = Node::start(Config::loopback(101, 1).group(own_group())).unwrap();
    let mut components = attach(&node, 1..=50).await;
    let mut costs = Vec::new();
    for numbers in [51..=150, 151..=250] {
        tokio::time::sleep(Duration::from_secs(4)).await;
        let before = resident();
        components.extend(attach(&node, numbers).await);
        tokio::time::sleep(Duration::from_secs(4)).await;
        costs.push(resident().saturating_sub(before) / 100);
    }
    println!("{costs:?} octets for each further component");
    assert!(costs[1] <= costs[0] * 3 / 2, "{costs:?}");
    for component in &components {
        assert_eq!(component.directory().len(), 250);
    }
    node.shutdown().await;
}
