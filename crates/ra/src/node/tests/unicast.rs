//! Discovery between hosts that multicast does not reach but that are configured as peers.

use super::*;

/// Two vehicles; only the first has the other configured as a peer.
fn world(dialects: Vec<Dialect>) -> World {
    let mut settings = Settings::default();
    settings.carrier.group_dialects = dialects;
    let mut world = World::with(2, &settings);
    world.multicast = false;
    settings.carrier.peers = vec![address(2).ip()];
    world.hosts[0].node = RaNode::new(settings);
    for (host, id) in [(0, 10), (1, 20)] {
        let node = &mut world.hosts[host].node;
        node.announce(world.now, vehicle(id)).unwrap();
    }
    world
}

#[test]
fn one_that_is_named_is_found_and_kept_without_multicast() {
    let mut world = world(vec![Dialect::Opc]);
    world.seconds(60);
    for (host, other) in [(0, 20), (1, 10)] {
        let [Event::Appeared(seen)] = &world.events(host)[..] else {
            panic!("{host}: lost or not seen")
        };
        assert_eq!((seen.id, seen.nodes.len()), (other, 1));
    }
}

#[test]
fn one_that_is_named_and_gone_is_lost_and_found_again() {
    let mut world = world(vec![Dialect::Opc]);
    world.seconds(5);
    world.events(0);
    let gone = world.hosts.remove(1);
    world.seconds(10);
    assert_eq!(world.events(0), [Event::Lost(20)]);
    world.hosts.push(gone);
    world.seconds(10);
    assert!(matches!(&world.events(0)[..], [Event::Appeared(_)]));
}

#[test]
fn who_waits_to_hear_a_framing_gets_the_first_word_in_both() {
    let mut settings = Settings::default();
    settings.carrier.group_dialects = Vec::new();
    settings.carrier.peers = vec![address(2).ip()];
    let mut node = RaNode::new(settings);
    let mut now = start();
    node.announce(now, vehicle(30)).unwrap();
    let mut first = Vec::new();
    for _ in 0..4 {
        let sent = std::iter::from_fn(|| node.poll_transmit());
        let to_peer = sent.filter(|it| it.to == To::Address(address(2)));
        first.extend(to_peer.map(|it| it.datagram[0]));
        now += Duration::from_secs(1);
        node.handle_timeout(now);
    }
    assert_eq!(first, [b'J', 1, b'J', 1]);
}
