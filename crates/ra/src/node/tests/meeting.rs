//! Two nodes discover each other, report changes, and detect a loss.

use super::*;

fn ids(subsystem: &RaSubsystemEntry) -> Vec<(u8, u8)> {
    let ids = subsystem
        .components()
        .map(|(id, _)| (id.component, id.instance));
    let mut ids: Vec<_> = ids.collect();
    ids.sort_unstable();
    ids
}

#[test]
fn two_nodes_find_names_and_services_of_each_other() {
    let mut world = World::of_vehicles(2);
    world.seconds(2);
    for (host, other) in [(0, 20), (1, 10)] {
        let [Event::Appeared(seen)] = &world.events(host)[..] else {
            panic!(
                "{:?}",
                world.hosts[host].node.subsystems().collect::<Vec<_>>()
            )
        };
        assert_eq!(seen.id, other);
        let shown = world.hosts[1 - host].node.own().next().unwrap();
        assert_eq!(seen, shown, "all that the other shows");
        assert_eq!(ids(seen), [(1, 1), (33, 1), (35, 1), (38, 1)]);
    }
}

#[test]
fn they_find_each_other_where_every_third_datagram_is_lost() {
    let mut world = World::of_vehicles(2);
    world.loses = 3;
    world.seconds(30);
    for host in [0, 1] {
        let appeared = world
            .events(host)
            .into_iter()
            .filter_map(|event| match event {
                Event::Appeared(seen) | Event::Changed(seen) => Some(seen),
                _ => None,
            });
        let seen = appeared.last().expect("it appeared");
        assert_eq!(&seen, world.hosts[1 - host].node.own().next().unwrap());
    }
}

#[test]
fn what_is_found_out_is_not_asked_for_without_end() {
    let mut world = World::of_vehicles(2);
    world.seconds(5);
    let before = world.sent;
    world.seconds(100);
    let sent = world.sent - before;
    assert!(sent < 2 * 100 + 200, "{sent}: heartbeats and little more");
}

#[test]
fn changes_are_told_once_for_all_that_happen_together() {
    let mut world = World::of_vehicles(2);
    world.seconds(3);
    world.events(1);
    let before = world.sent;
    for number in 0..4 {
        let mut more = vehicle(10);
        let new = (40..=40 + number).map(|number| component(number, "New"));
        more.nodes[0].components.extend(new);
        world.hosts[0].node.announce(world.now, more).unwrap();
        world.pass(Duration::from_millis(20));
    }
    world.pass(Duration::from_millis(500));
    let [Event::Changed(seen)] = &world.events(1)[..] else {
        panic!("one change")
    };
    assert_eq!(seen, world.hosts[0].node.own().next().unwrap());
    assert!(world.sent - before < 4 * 4 + 8, "{}", world.sent - before);
    world.hosts[0]
        .node
        .announce(world.now, vehicle(10))
        .unwrap();
    world.pass(Duration::from_millis(500));
    let [Event::Changed(seen)] = &world.events(1)[..] else {
        panic!("gone again")
    };
    assert_eq!(ids(seen), [(1, 1), (33, 1), (35, 1), (38, 1)]);
}

#[test]
fn who_says_goodbye_is_gone_at_once_and_who_falls_silent_after_a_while() {
    let mut world = World::of_vehicles(2);
    world.seconds(3);
    world.events(0);
    world.events(1);
    world.hosts[0].node.withdraw(world.now, 10);
    world.exchange();
    assert_eq!(world.events(1), [Event::Lost(10)]);
    world.hosts[0]
        .node
        .announce(world.now, vehicle(10))
        .unwrap();
    world.seconds(3);
    assert!(matches!(&world.events(1)[..], [Event::Appeared(_)]));
    world.hosts.remove(0);
    world.seconds(4);
    assert_eq!(world.events(0), []);
    world.seconds(2);
    assert_eq!(world.events(0), [Event::Lost(10)]);
    assert_eq!(world.hosts[0].node.subsystems().count(), 0);
}

#[test]
fn who_was_away_is_found_again() {
    let mut world = World::of_vehicles(2);
    world.seconds(3);
    world.loses = 1;
    world.seconds(10);
    world.events(0);
    world.loses = 0;
    world.seconds(3);
    assert!(matches!(&world.events(0)[..], [Event::Appeared(_)]));
}

#[test]
fn one_node_shows_many_subsystems() {
    let mut world = World::new(2);
    for id in 1..=40 {
        world.hosts[0]
            .node
            .announce(world.now, vehicle(id))
            .unwrap();
    }
    world.hosts[1]
        .node
        .announce(world.now, vehicle(200))
        .unwrap();
    world.seconds(20);
    let appeared = world.events(1);
    assert_eq!(appeared.len(), 40);
    assert!(
        appeared
            .iter()
            .all(|event| matches!(event, Event::Appeared(_)))
    );
}

#[test]
fn messages_go_between_components_large_ones_too() {
    let mut world = World::of_vehicles(2);
    world.seconds(2);
    world.events(1);
    let (from, to) = (RaId::new(10, 1, 33, 1), RaId::new(20, 1, 38, 1));
    let data: Bytes = (0..100_000_u32).map(|i| i as u8).collect();
    let mut large = Message::new(from, to, 0x4402, data);
    large.connection = true;
    world.hosts[0].node.send(world.now, &large).unwrap();
    world.seconds(1);
    let [Event::Message(arrived)] = &world.events(1)[..] else {
        panic!()
    };
    assert_eq!(arrived.data, large.data);
    assert!(arrived.connection && arrived.source == from && arrived.destination == to);
}

#[test]
fn a_peer_of_the_other_framing_is_found_too() {
    let mut world = World::new(2);
    let mut settings = Settings::default();
    settings.carrier.group_dialects = vec![Dialect::As5669];
    world.hosts[0].node = RaNode::new(settings);
    for (host, id) in [(0, 10), (1, 20)] {
        let node = &mut world.hosts[host].node;
        node.announce(world.now, vehicle(id)).unwrap();
    }
    world.seconds(3);
    assert!(matches!(&world.events(0)[..], [Event::Appeared(_)]));
    assert!(matches!(&world.events(1)[..], [Event::Appeared(_)]));
}

#[test]
fn what_cannot_be_shown_says_why() {
    let (now, mut node) = (start(), RaNode::new(Settings::default()));
    let refused = |node: &mut RaNode, subsystem| node.announce(now, subsystem).unwrap_err();
    assert_eq!(
        refused(&mut node, vehicle(255)).to_string(),
        "subsystem 255 is out of range: use 1 to 254"
    );
    let mut twice = vehicle(1);
    twice.nodes[0].components.push(component(33, "Again"));
    assert_eq!(
        refused(&mut node, twice),
        BadSubsystem::Twice(RaId::new(1, 1, 33, 1))
    );
    let mut many = vehicle(1);
    many.nodes[0].components[0].services[0].inputs = vec![Command::default(); 256];
    assert!(matches!(
        refused(&mut node, many),
        BadSubsystem::TooMany(..)
    ));
    let mut rig = Rig::new(Settings::default());
    let peer = RaId::new(10, 1, 35, 1);
    rig.hear(1, peer, RaId::new(255, 255, 1, 1), 0x4202, &[]);
    assert_eq!(
        refused(&mut rig.node, vehicle(10)).to_string(),
        "subsystem 10 exists already, at 10.77.0.1: give ours another number"
    );
}

#[test]
fn who_shows_nothing_asks_nothing_and_sleeps() {
    let mut world = World::of_vehicles(2);
    world.seconds(3);
    let node = &mut world.hosts[0].node;
    node.withdraw(world.now, 10);
    while node.poll_transmit().is_some() {}
    world.hosts.truncate(1);
    let before = world.sent;
    world.seconds(60);
    assert_eq!(world.sent, before);
    assert_eq!(world.hosts[0].node.poll_timeout(), None);
}

#[test]
fn questions_go_on_in_the_name_of_the_next_subsystem() {
    let mut world = World::of_vehicles(2);
    world.hosts[0]
        .node
        .announce(world.now, vehicle(11))
        .unwrap();
    world.seconds(3);
    world.hosts[0].node.withdraw(world.now, 10);
    world.seconds(1);
    world.events(0);
    let mut less = vehicle(20);
    less.nodes[0].components.pop();
    world.hosts[1].node.announce(world.now, less).unwrap();
    world.seconds(1);
    assert!(
        matches!(&world.events(0)[..], [Event::Changed(_)]),
        "told at once"
    );
}
