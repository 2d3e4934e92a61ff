//! How one router forwards single frames.

use super::*;

/// A router that knows A on network 0 and C on network 1; the test injects its input.
struct Between {
    world: World,
    router: usize,
}

impl Between {
    fn new(config: Config) -> Self {
        let mut world = World::new();
        let router = world.add(config, &[0, 1]);
        let mut between = Self { world, router };
        between.hear(0, 7, &message(A, JausId::EVERYONE, 1));
        between.hear(1, 8, &message(C, JausId::EVERYONE, 1));
        between.sent();
        between
    }

    fn hear(&mut self, network: u8, host: u8, frame: &Frame) {
        let path = Path {
            link: LinkId(network.into()),
            peer: SocketAddr::from(([10, 0, network, host], judp::PORT)).into(),
        };
        let datagram = judp::encode(frame).unwrap();
        let (now, inbox) = (self.world.now, &mut self.world.inboxes[self.router]);
        self.world.nodes[self.router].handle_datagram(now, path, datagram, inbox);
    }

    fn sent(&mut self) -> Vec<(LinkId, To, Frame)> {
        let now = self.world.now;
        let router = &mut self.world.nodes[self.router];
        let read = |transmit: Transmit| {
            let mut frames = judp::frames(transmit.payload).unwrap();
            let frame = frames.next().unwrap().unwrap();
            (transmit.link, transmit.to, frame)
        };
        std::iter::from_fn(|| router.poll_transmit(now))
            .map(read)
            .collect()
    }

    fn count(&self, counter: Counter) -> u64 {
        self.world.count(self.router, counter)
    }
}

fn message(source: JausId, destination: JausId, sequence: u16) -> Frame {
    let payload = Bytes::from_static(QUERY_IDENTIFICATION);
    Frame {
        sequence,
        ..Frame::new(source, destination, payload)
    }
}

/// As recorded: Junior sends a message for an unknown id to the group, with the flags of a global
/// broadcast and an acknowledgement request. Its relay does not change them.
#[test]
fn flags_ids_and_number_stay_as_they_came() {
    let mut between = Between::new(router_config());
    let flags = Flags::new(Priority::High)
        .with_broadcast(Broadcast::Global)
        .with_acknowledgement(Acknowledgement::Request);
    let frame = Frame {
        flags,
        ..message(A, C, 77)
    };
    between.hear(0, 7, &frame);
    let there = To::Peer(SocketAddr::from(([10, 0, 1, 8], judp::PORT)).into());
    assert_eq!(between.sent(), [(LinkId(1), there, frame)]);
}

#[test]
fn a_repeated_message_is_passed_on_again_and_a_copy_from_elsewhere_is_not() {
    let mut between = Between::new(router_config());
    let frame = acknowledged(C);
    for _try in 0..3 {
        between.hear(0, 7, &frame);
        between.hear(0, 7, &frame);
        between.hear(0, 99, &frame);
        assert_eq!(between.sent().len(), 1, "once for each true repetition");
        between.world.now += Duration::from_millis(100);
    }
    let once = message(A, C, 6);
    between.hear(0, 7, &once);
    between.world.now += Duration::from_millis(50);
    between.hear(0, 7, &once);
    assert_eq!(between.sent().len(), 1, "nobody waits for it");
    let known = between.world.whereabouts(between.router, A).unwrap();
    assert_eq!(
        known.peer,
        Remote::Socket(SocketAddr::from(([10, 0, 0, 7], judp::PORT)))
    );
}

fn acknowledged(destination: JausId) -> Frame {
    Frame {
        flags: Flags::default().with_acknowledgement(Acknowledgement::Request),
        ..message(A, destination, 5)
    }
}

/// In a ring of routers, the frame returns on the path on which it first arrived, until one of them
/// drops it.
#[test]
fn what_goes_round_between_routers_is_dropped_after_a_few_rounds() {
    for destination in [C, JausId::EVERYONE, JausId::new(9, 9, 9)] {
        for (round, most) in [(5, 3), (30, 4), (100, 6), (300, 7)] {
            let mut between = Between::new(router_config());
            let frame = acknowledged(destination);
            let mut passed = 0;
            loop {
                between.hear(0, 7, &frame);
                if between.sent().is_empty() {
                    break;
                }
                passed += 1;
                assert!(passed <= most, "{passed} rounds of {round} ms");
                between.world.now += Duration::from_millis(round);
            }
            between.world.now += Duration::from_secs(4);
            between.hear(0, 7, &frame);
            assert_eq!(between.sent().len(), 1, "a new message with an old number");
        }
    }
}

/// An endpoint backs off from 10 ms at least, and tries up to 20 times.
#[test]
fn a_sender_that_backs_off_is_passed_on_each_time() {
    let mut between = Between::new(router_config());
    let frame = acknowledged(C);
    for attempt in 0..20 {
        between.hear(0, 7, &frame);
        assert_eq!(between.sent().len(), 1, "attempt {attempt}");
        let pause = Duration::from_millis(10 << attempt.min(8));
        between.world.now += pause.min(Duration::from_secs(2));
    }
}

#[test]
fn the_next_hops_header_is_spoken() {
    let mut between = Between::new(router_config());
    let old = |frame| Frame {
        version: Version::Ra,
        ..frame
    };
    between.hear(1, 8, &old(message(C, A, 0)));
    assert_eq!(between.sent()[0].2.version, Version::As5669a);
    between.hear(0, 7, &message(A, C, 9));
    let there = between.sent();
    assert_eq!(there[0].2.version, Version::Ra);
    assert_eq!(there[0].2.payload, QUERY_IDENTIFICATION);
    let wish = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let answer = Frame {
        flags: wish,
        ..old(message(C, A, 9))
    };
    let bare = answer.payload.slice(..2);
    between.hear(
        1,
        8,
        &Frame {
            payload: bare,
            ..answer
        },
    );
    let back = between.sent();
    assert!(back[0].2.is_acknowledgement() && back[0].2.version == Version::As5669a);
    let later = Flags::default().with_data(crate::wire::DataControl::Last);
    between.hear(
        0,
        7,
        &Frame {
            flags: later,
            ..message(A, C, 10)
        },
    );
    assert_eq!(between.sent(), [], "an older header would need the code");
    assert_eq!(between.count(Counter::CannotForward), 1);
}

#[test]
fn broadcasts_are_passed_on_at_a_bounded_rate_and_only_from_where_their_sender_is() {
    let mut between = Between::new(router_config());
    for sequence in 0..10_000 {
        between.hear(0, 7, &message(A, JausId::EVERYONE, sequence));
        between.world.now += Duration::from_micros(100);
    }
    let passed = between.count(Counter::MessagesForwarded);
    assert!((1400..=1600).contains(&passed), "{passed} in a second");
    between.sent();
    between.world.now += Duration::from_millis(100);
    between.hear(0, 7, &message(A, JausId::EVERYONE, 20_000));
    assert_eq!(between.sent().len(), 1);
    between.hear(1, 66, &message(A, JausId::EVERYONE, 20_001));
    assert_eq!(
        between.sent(),
        [],
        "A was heard on the other network just now"
    );
    assert_eq!(between.count(Counter::NotTheWayBack), 1);
}

#[test]
fn nothing_goes_back_to_where_it_came_from() {
    let mut between = Between::new(router_config());
    between.hear(0, 7, &message(B, JausId::EVERYONE, 1));
    between.sent();
    // Both share one address, or heard each other through the group.
    between.hear(0, 7, &message(A, B, 2));
    let group = Flags::default().with_broadcast(Broadcast::Global);
    between.hear(
        0,
        9,
        &Frame {
            flags: group,
            ..message(JausId::new(4, 1, 1), A, 3)
        },
    );
    assert_eq!(between.sent(), []);
    // Sent to the router alone, to be forwarded to a neighbour.
    between.hear(0, 9, &message(JausId::new(4, 1, 1), A, 4));
    assert_eq!(between.sent().len(), 1);
}

#[test]
fn what_the_lists_do_not_allow_is_not_passed_on() {
    let mut between = Between::new(Config {
        access: Access {
            deny_subsystems: vec!["3".parse().unwrap(), "5-6".parse().unwrap()],
            ..Access::default()
        },
        ..router_config()
    });
    between.hear(0, 7, &message(A, C, 2));
    between.hear(0, 7, &message(JausId::new(6, 1, 1), A, 2));
    assert_eq!(between.sent(), []);
    assert_eq!(
        between.count(Counter::SubsystemDenied),
        3,
        "C at first, too"
    );
}

#[test]
fn a_bound_id_is_not_passed_on_from_other_networks() {
    let mut between = Between::new(Config {
        access: Access {
            bind: vec!["1.255.255@10.0.0.7".parse().unwrap()],
            ..Access::default()
        },
        ..router_config()
    });
    between.hear(0, 9, &message(A, C, 2));
    between.hear(1, 8, &message(A, B, 3));
    assert_eq!(between.sent(), []);
    assert_eq!(between.count(Counter::BoundElsewhere), 2);
    between.hear(0, 7, &message(A, C, 4));
    assert_eq!(between.sent().len(), 1);
}

#[test]
fn a_message_on_another_path_is_a_copy_as_long_as_it_may_be_repeated() {
    let window = Config::default().retransmission_window;
    for (pause, passed) in [(window - Duration::from_millis(1), 0), (window, 1)] {
        let mut between = Between::new(router_config());
        between.hear(0, 7, &acknowledged(C));
        between.sent();
        between.world.now += pause;
        between.hear(0, 99, &acknowledged(C));
        assert_eq!(between.sent().len(), passed, "after {pause:?}");
    }
}

#[test]
fn a_repetition_that_comes_too_soon_for_its_sender_is_a_copy() {
    for (pause, passed) in [(999, 0), (1000, 1)] {
        let mut between = Between::new(router_config());
        between.hear(0, 7, &acknowledged(C));
        between.sent();
        between.world.now += Duration::from_micros(pause);
        between.hear(0, 7, &acknowledged(C));
        assert_eq!(between.sent().len(), passed, "after {pause} µs");
    }
}

#[test]
fn older_messages_without_numbers_are_copies_only_on_another_path() {
    let mut between = Between::new(router_config());
    let older = Frame {
        version: Version::Ra,
        ..message(A, C, 0)
    };
    for (host, passed) in [(7, 1), (7, 1), (99, 0), (7, 1)] {
        between.hear(0, host, &older);
        assert_eq!(between.sent().len(), passed, "from host {host}");
    }
}

#[test]
fn a_message_for_many_is_astray_where_its_sender_was_not_heard_in_the_last_second() {
    let (none, group) = (Broadcast::None, Broadcast::Global);
    let unknown = JausId::new(9, 9, 9);
    for (destination, broadcast, pause, astray) in [
        (C, none, 0, 0),
        (C, group, 0, 1),
        (unknown, none, 0, 1),
        (JausId::EVERYONE, none, 999, 1),
        (JausId::EVERYONE, none, 1000, 0),
    ] {
        let mut between = Between::new(router_config());
        between.world.now += Duration::from_millis(pause);
        let frame = Frame {
            flags: Flags::default().with_broadcast(broadcast),
            ..message(A, destination, 2)
        };
        between.hear(1, 66, &frame);
        let row = (destination, broadcast, pause);
        assert_eq!(between.count(Counter::NotTheWayBack), astray, "{row:?}");
    }
}

#[test]
fn neither_an_invalid_destination_nor_an_answer_is_searched_for() {
    let mut between = Between::new(router_config());
    between.hear(0, 7, &message(A, JausId::new(3, 0, 1), 2));
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let answer = Frame {
        flags,
        payload: Bytes::new(),
        ..message(A, JausId::new(9, 9, 9), 3)
    };
    between.hear(0, 7, &answer);
    assert_eq!(between.sent(), []);
    assert_eq!(between.count(Counter::NotForUs), 2);
}

/// A link of connections has no group: each connection is a hop of its own.
#[test]
fn a_broadcast_from_a_connection_goes_to_the_other_connections_and_links() {
    let mut world = World::new();
    let router = world.add(router_config(), &[0]);
    world.plug(router, 1, Framing::Jtcp);
    let connection = |host| Path {
        link: LinkId(1),
        peer: SocketAddr::from(([10, 0, 1, host], 4000)).into(),
    };
    let sent = |world: &mut World| -> Vec<_> {
        let router = &mut world.nodes[router];
        let transmits = std::iter::from_fn(|| router.poll_transmit(world.now));
        transmits.map(|it| (it.link, it.to)).collect()
    };
    for (host, source) in [(7, A), (8, B), (9, C), (9, JausId::new(4, 1, 1))] {
        let heard = message(source, JausId::EVERYONE, 1);
        let (now, inbox) = (world.now, &mut world.inboxes[router]);
        world.nodes[router].handle_frame(now, connection(host), &heard, inbox);
    }
    sent(&mut world);
    let heard = message(A, JausId::EVERYONE, 2);
    let (now, inbox) = (world.now, &mut world.inboxes[router]);
    world.nodes[router].handle_frame(now, connection(7), &heard, inbox);
    let to = |host| (LinkId(1), To::Peer(connection(host).peer));
    assert_eq!(sent(&mut world), [(LinkId(0), To::Group), to(8), to(9)]);
}
