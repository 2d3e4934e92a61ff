//! Endpoints on a simulated network, under good and poor conditions.

#![expect(clippy::expect_used, reason = "helpers of tests")]

use std::collections::HashMap;
use std::time::Duration;

use crate::sim::{Conditions, Host, Mailbox, Network};
use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::{
    Config, Counter, Endpoint, Event, Limits, Outgoing, Shortfall, Unacknowledged,
};

const ONE: JausId = JausId::new(101, 1, 1);
const OTHER: JausId = JausId::new(102, 1, 1);
const THIRD: JausId = JausId::new(103, 1, 1);

fn endpoint(id: JausId) -> Endpoint {
    endpoint_with(id, Config::default())
}

fn endpoint_with(id: JausId, config: Config) -> Endpoint {
    let mut endpoint = Endpoint::new(config);
    endpoint.attach(id).expect("an id of one component");
    endpoint
}

fn network(seed: u64, conditions: Conditions, ids: &[JausId]) -> (Network, Vec<Host>) {
    let mut network = Network::new(seed, conditions);
    let hosts = ids
        .iter()
        .map(|&id| network.join(endpoint(id), Mailbox::default()))
        .collect();
    (network, hosts)
}

/// A report with a number, so that each is distinguishable.
fn numbered(number: u32) -> Bytes {
    let mut payload = BytesMut::from(&b"\x02\x44"[..]);
    payload.put_u32_le(number);
    payload.freeze()
}

fn number_of(payload: &[u8]) -> u32 {
    let octets = payload[2..6].try_into().expect("a numbered report");
    u32::from_le_bytes(octets)
}

fn message(number: u32) -> Outgoing {
    Outgoing::new(ONE, OTHER, numbered(number))
}

#[test]
fn strangers_find_each_other_by_one_multicast_and_go_on_by_unicast() {
    let (mut network, hosts) = network(1, Conditions::good(), &[ONE, OTHER, THIRD]);
    network.send(hosts[0], message(0)).unwrap();
    network.run_until_idle();
    assert_eq!(
        (network.carried(), network.multicast()),
        (2, 1),
        "the message and its acknowledgement"
    );
    for number in 1..=10 {
        network.send(hosts[0], message(number)).unwrap();
        network
            .send(hosts[1], Outgoing::new(OTHER, ONE, numbered(number)))
            .unwrap();
        network.run_until_idle();
    }
    assert_eq!((network.carried(), network.multicast()), (22, 1));
    assert_eq!(network.owner(hosts[1]).take_messages().len(), 11);
    assert_eq!(network.owner(hosts[0]).take_messages().len(), 10);
    assert_eq!(
        network.endpoint(hosts[0]).counters().get(Counter::OwnEcho),
        1
    );
    assert_eq!(
        network.endpoint(hosts[2]).counters().get(Counter::NotForUs),
        1
    );
    assert!(network.owner(hosts[2]).events.is_empty());
}

#[test]
fn acknowledged_messages_survive_a_poor_wire_and_arrive_once() {
    for seed in 0..30 {
        let (mut network, hosts) = network(seed, Conditions::poor(), &[ONE, OTHER]);
        let mut sent = HashMap::new();
        for number in 0..50 {
            let handle = network
                .send(
                    hosts[0],
                    Outgoing {
                        acknowledge: true,
                        ..message(number)
                    },
                )
                .unwrap();
            sent.insert(handle, number);
            network.run_for(Duration::from_millis(5));
        }
        network.run_until_idle();
        let mut arrived = HashMap::new();
        for received in network.owner(hosts[1]).take_messages() {
            *arrived.entry(number_of(&received.payload)).or_insert(0) += 1;
        }
        assert!(
            arrived.values().all(|&copies| copies == 1),
            "seed {seed}: {arrived:?}"
        );
        let mut told = 0;
        for news in network.owner(hosts[0]).take_news() {
            match news {
                Event::Acknowledged { message, .. } => {
                    assert!(
                        arrived.contains_key(&sent[&message]),
                        "seed {seed}: acknowledged but not there"
                    );
                    told += 1;
                }
                Event::NotAcknowledged { shortfall, .. } => {
                    assert_eq!(shortfall.reason, Unacknowledged::TimedOut);
                    told += 1;
                }
                _ => {}
            }
        }
        assert_eq!(told, 50, "seed {seed}: each message has its result");
        assert!(
            arrived.len() >= 48,
            "seed {seed}: four tries lose few: {} of 50",
            arrived.len()
        );
    }
}

#[test]
fn a_wire_that_repeats_and_reorders_delivers_nothing_twice() {
    for seed in 0..30 {
        let conditions = Conditions {
            lost: 0,
            repeated: 500,
            ..Conditions::poor()
        };
        let (mut network, hosts) = network(seed, conditions, &[ONE, OTHER]);
        for number in 0..200 {
            network.send(hosts[0], message(number)).unwrap();
            network.run_for(Duration::from_millis(2));
        }
        network.run_until_idle();
        let received = network.owner(hosts[1]).take_messages();
        let mut numbers: Vec<_> = received
            .iter()
            .map(|received| number_of(&received.payload))
            .collect();
        numbers.sort_unstable();
        assert_eq!(numbers, (0..200).collect::<Vec<_>>(), "seed {seed}");
        assert!(
            network
                .endpoint(hosts[1])
                .counters()
                .get(Counter::Duplicate)
                > 50,
            "seed {seed}"
        );
    }
}

#[test]
fn large_messages_survive_reordering_and_with_acknowledgement_loss() {
    for seed in 0..10 {
        let (mut network, hosts) = network(seed, Conditions::poor(), &[ONE, OTHER]);
        network
            .send(
                hosts[1],
                Outgoing {
                    acknowledge: true,
                    ..Outgoing::new(OTHER, ONE, numbered(0))
                },
            )
            .unwrap();
        network.run_until_idle();
        network.set_conditions(Conditions {
            lost: 20,
            ..Conditions::poor()
        });
        let payload: Bytes = (0..100_000_u32).map(|index| (index % 251) as u8).collect();
        let handle = network
            .send(
                hosts[0],
                Outgoing {
                    acknowledge: true,
                    payload: payload.clone(),
                    ..message(0)
                },
            )
            .unwrap();
        network.run_until_idle();
        let arrived = network.owner(hosts[1]).take_messages();
        assert!(
            arrived
                .iter()
                .map(|received| &received.payload)
                .eq([&payload]),
            "seed {seed}"
        );
        let news = network.owner(hosts[0]).take_news();
        assert!(
            news.contains(&Event::Acknowledged {
                message: handle,
                by: OTHER
            }),
            "seed {seed}"
        );
    }
}

#[test]
fn a_restarted_node_does_not_lose_its_first_messages() {
    let (mut network, hosts) = network(3, Conditions::good(), &[ONE, OTHER]);
    for _life in 0..5 {
        for number in 0..3 {
            network.send(hosts[0], message(number)).unwrap();
        }
        network.run_for(Duration::from_secs(1));
        assert_eq!(network.owner(hosts[1]).take_messages().len(), 3);
        network.restart(hosts[0], endpoint(ONE), Mailbox::default());
    }
}

#[test]
fn a_broadcast_reaches_everyone_and_a_local_one_the_own_subsystem() {
    let neighbour = JausId::new(101, 2, 1);
    let (mut network, hosts) = network(4, Conditions::good(), &[ONE, OTHER, neighbour]);
    let everyone = Outgoing::new(ONE, JausId::EVERYONE, numbered(0));
    network.send(hosts[0], everyone.clone()).unwrap();
    network.run_until_idle();
    let reached = |network: &mut Network| {
        [0, 1, 2].map(|host: usize| network.owner(hosts[host]).take_messages().len())
    };
    assert_eq!(reached(&mut network), [0, 1, 1]);
    let local = Outgoing {
        broadcast: jaus::wire::Broadcast::Local,
        ..everyone
    };
    network.send(hosts[0], local).unwrap();
    network.run_until_idle();
    assert_eq!(reached(&mut network), [0, 0, 1]);
}

#[test]
fn two_nodes_with_one_id_are_both_told() {
    let (mut network, hosts) = network(5, Conditions::good(), &[ONE, ONE]);
    for host in [hosts[0], hosts[1]] {
        network
            .send(host, Outgoing::new(ONE, JausId::EVERYONE, numbered(0)))
            .unwrap();
    }
    network.run_until_idle();
    for (host, other) in [(hosts[0], hosts[1]), (hosts[1], hosts[0])] {
        let peer = network.address(other);
        let conflict = |event: &Event| matches!(event, Event::IdConflict { id: ONE, path } if path.peer == peer.into());
        assert!(network.owner(host).take_news().iter().any(conflict));
    }
}

#[test]
fn a_cut_wire_is_told_and_heals() {
    let (mut network, hosts) = network(6, Conditions::good(), &[ONE, OTHER]);
    network
        .send(
            hosts[0],
            Outgoing {
                acknowledge: true,
                ..message(0)
            },
        )
        .unwrap();
    network.run_until_idle();
    network.set_cut(hosts[0], hosts[1], true);
    let lost = network
        .send(
            hosts[0],
            Outgoing {
                acknowledge: true,
                ..message(1)
            },
        )
        .unwrap();
    network.run_until_idle();
    let failed = Event::NotAcknowledged {
        message: lost,
        shortfall: Shortfall {
            destination: OTHER,
            reason: Unacknowledged::TimedOut,
            acknowledged: 0,
            length: message(1).payload.len() as u32,
        },
    };
    assert!(network.owner(hosts[0]).take_news().contains(&failed));
    network.set_cut(hosts[0], hosts[1], false);
    network.send(hosts[0], message(2)).unwrap();
    network.run_until_idle();
    let numbers: Vec<_> = network
        .owner(hosts[1])
        .take_messages()
        .iter()
        .map(|received| number_of(&received.payload))
        .collect();
    assert_eq!(numbers, [0, 2]);
}

#[test]
fn a_flood_of_invented_peers_is_bounded_and_leaves_the_node_working() {
    let mut network = Network::new(7, Conditions::good());
    let config = Config {
        limits: Limits {
            max_peers: 50,
            ..Limits::default()
        },
        ..Config::default()
    };
    let victim = network.join(endpoint_with(OTHER, config), Mailbox::default());
    let flooder = network.join(Endpoint::new(Config::default()), Mailbox::default());
    for subsystem in 1000..2000 {
        let invented = JausId::new(subsystem, 1, 1);
        network.endpoint(flooder).attach(invented).unwrap();
        network
            .send(flooder, Outgoing::new(invented, OTHER, numbered(0)))
            .unwrap();
        network.endpoint(flooder).detach(invented);
    }
    network.run_for(Duration::from_millis(1));
    let honest = network.join(endpoint(ONE), Mailbox::default());
    network.send(honest, message(1)).unwrap();
    network.run_until_idle();
    assert_eq!(network.endpoint(victim).peers().count(), 50);
    assert!(network.endpoint(victim).peers().any(|peer| peer.id == ONE));
    assert_eq!(network.owner(victim).take_messages().len(), 1001);
}

/// The time to deliver 4000 acknowledged messages over a round trip of 10 ms.
fn time_for_4000(seed: u64, lost_of_1000: u32) -> Duration {
    let delay = Duration::from_millis(5);
    let conditions = Conditions {
        lost: lost_of_1000,
        latency: delay..delay,
        ..Conditions::good()
    };
    let (mut network, hosts) = network(seed, conditions, &[ONE, OTHER]);
    let acknowledged = |number| Outgoing {
        acknowledge: true,
        ..message(number)
    };
    // The two nodes discover each other first.
    network
        .send(hosts[0], acknowledged(4000))
        .expect("room for it");
    network.run_until_idle();
    network.owner(hosts[1]).take_messages();
    let begun = network.now();
    for number in 0..4000 {
        network
            .send(hosts[0], acknowledged(number))
            .expect("room for it");
    }
    let mut delivered = 0;
    while delivered < 4000 {
        assert!(network.step(), "everything arrives");
        delivered += network.owner(hosts[1]).take_messages().len();
    }
    network.now() - begun
}

#[test]
fn five_percent_of_loss_each_way_costs_at_most_half_of_the_rate() {
    for seed in 0..10 {
        let (without, with) = (time_for_4000(seed, 0), time_for_4000(seed, 50));
        assert!(with <= 2 * without, "seed {seed}: {with:?}, {without:?}");
    }
}
