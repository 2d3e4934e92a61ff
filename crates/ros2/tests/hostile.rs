//! What arrives from the network, arbitrary or changed on its way: it is read or refused, and allocates
//! no more than its own length justifies.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

mod arbitrary;

use std::alloc::System;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use jaus_ros2::graph::{Endpoint, EntityKind, Graph, NodeName, Token, tokens_key};
use jaus_ros2::{Attachment, Gid, Interface, Interfaces, Message, Qos, cdr};
use proptest::prelude::*;
use proptest::sample::Index;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

use arbitrary::{everything, interface, message_of};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Makes the tests run one at a time: the allocations of others would be counted too.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What an octet of the input may allocate: a value in a sequence that grows, and the messages around it.
const MOST_PER_OCTET: usize = 256;
/// What an error, and the harness of the tests, may allocate.
const MARGIN: usize = 1 << 16;

/// Reads an input, and requires that its length justifies what that allocates.
fn bounded<T>(length: usize, read: impl FnOnce() -> T) -> T {
    let region = Region::new(ALLOCATOR);
    let result = read();
    let allocated = region.change().bytes_allocated;
    let most = length * MOST_PER_OCTET + MARGIN;
    assert!(allocated <= most, "{length} octets allocate {allocated}");
    result
}

/// Requires that an error message is of moderate length, and does not disturb a log.
fn assert_printable(error: &impl ToString) {
    let text = error.to_string();
    assert!(text.len() < 1000, "{text}");
    assert!(!text.contains(char::is_control), "{text:?}");
}

/// Decodes octets: what is read is a message of the type, which can be sent on.
fn decode(interface: &Arc<Interface>, octets: &[u8]) {
    match bounded(octets.len(), || cdr::decode(interface, octets)) {
        Ok(message) => {
            let sent = cdr::encode(&message);
            let again = Message::from_value(interface, message.into()).unwrap();
            assert_eq!(cdr::encode(&again), sent);
            cdr::decode(interface, &sent).unwrap();
        }
        Err(error) => {
            assert!(error.offset <= octets.len(), "{error}");
            assert_printable(&error);
        }
    }
}

#[test]
fn any_octets_are_read_or_refused() {
    let _alone = alone();
    let types = [
        everything(),
        interface("std_msgs/Empty[] a\nstring[] b\nuint8[] c"),
        interface("tf2_msgs/TFMessage[] a"),
        interface("string<=3[<=5] a\nbool[] b"),
    ];
    // Many zeros, which are lengths of nothing, and small numbers, which are lengths that may be right.
    let octet = prop_oneof![Just(0), 0..8_u8, any::<u8>()];
    let body = prop::collection::vec(octet, 0..400);
    proptest!(|(body in body, is_little: bool)| {
        let octets = [&[0, is_little.into(), 0, 0], &body[..]].concat();
        types.iter().for_each(|it| decode(it, &octets));
        types.iter().for_each(|it| decode(it, &body));
    });
}

#[test]
fn a_message_whose_lengths_lie_is_read_or_refused() {
    let _alone = alone();
    let lie = prop_oneof![0..8_u32, any::<u32>(), Just(1 << 31), Just(u32::MAX)];
    let lies = prop::collection::vec((any::<Index>(), lie), 1..3);
    proptest!(|(message in message_of(&everything()), lies in lies, is_little: bool)| {
        let (mut octets, lengths) = arbitrary::encode(&message, is_little);
        for (which, lie) in lies {
            let at = lengths[which.index(lengths.len())];
            let lie = if is_little { lie.to_le_bytes() } else { lie.to_be_bytes() };
            octets[at..at + 4].copy_from_slice(&lie);
        }
        decode(message.interface(), &octets);
    });
}

#[test]
fn a_message_that_is_changed_and_cut_is_read_or_refused() {
    let _alone = alone();
    let changes = prop::collection::vec((any::<Index>(), any::<u8>()), 0..8);
    let message = message_of(&everything());
    proptest!(|(message in message, changes in changes, end: Index, is_little: bool)| {
        let (mut octets, _) = arbitrary::encode(&message, is_little);
        for (at, octet) in changes {
            let at = at.index(octets.len());
            octets[at] = octet;
        }
        decode(message.interface(), &octets);
        octets.truncate(end.index(octets.len()));
        decode(message.interface(), &octets);
    });
}

#[test]
fn the_longest_sequence_of_the_smallest_messages_allocates_in_proportion() {
    let _alone = alone();
    for (text, width) in [("std_msgs/Empty[] a", 1), ("string[] a", 4)] {
        let count = u32::try_from((cdr::LONGEST - 8) / width).unwrap();
        let mut octets = [&[0, 1, 0, 0], &count.to_le_bytes()[..]].concat();
        octets.resize(cdr::LONGEST, 0);
        let interface = interface(text);
        let decoded = bounded(octets.len(), || cdr::decode(&interface, &octets));
        assert!(decoded.is_ok(), "{text}");
    }
}

#[test]
fn a_few_octets_for_a_type_with_many_fields_allocate_little() {
    let _alone = alone();
    let mut fields = String::new();
    for number in 0..1000 {
        writeln!(fields, "uint8 a{number}").unwrap();
    }
    let mut interfaces = Interfaces::default();
    interfaces.add("test_msgs/Level0", &fields).unwrap();
    for level in 1..20 {
        let text = format!("Level{} inner\n{fields}", level - 1);
        let name = format!("test_msgs/Level{level}");
        interfaces.add(&name, &text).unwrap();
    }
    let interface = interfaces.get("test_msgs/Level19").unwrap();
    decode(&interface, &[0, 1, 0, 0, 7]);
}

#[test]
fn an_attachment_is_read_if_its_length_and_that_of_its_gid_are_right() {
    let _alone = alone();
    let octets = prop::collection::vec(any::<u8>(), 0..60);
    let gid_length = prop_oneof![Just(16), any::<u8>()];
    proptest!(|(mut octets in octets, gid_length in gid_length, is_long: bool)| {
        if is_long {
            octets.resize(33, 0);
            octets[16] = gid_length;
        }
        let is_right = octets.len() == 33 && octets[16] == 16;
        match Attachment::decode(&octets) {
            Ok(attachment) => prop_assert_eq!(attachment.encode().to_vec(), octets),
            Err(error) => {
                prop_assert!(!is_right, "{octets:?}");
                assert_printable(&error);
            }
        }
    });
}

/// The key of a liveliness token, and keys that look like one.
fn keys() -> impl Strategy<Value = String> {
    let chunk = "[a-z0-9%:,@]{0,12}|[^/]{0,6}|[0-9]{1,24}|NN|MP|MS|%|";
    let like = prop::collection::vec(chunk, 0..14).prop_map(|chunks| {
        let chunks = chunks.join("/");
        format!("@ros2_lv/0/a1/3/4/{chunks}")
    });
    let changed = (tokens(), any::<Index>(), any::<char>()).prop_map(|(token, at, new)| {
        let mut key: Vec<_> = token.to_string().chars().collect();
        let at = at.index(key.len());
        key[at] = new;
        String::from_iter(key)
    });
    let token = tokens().prop_map(|token| token.to_string());
    let long =
        (1..1000_usize).prop_map(|number| format!("@ros2_lv/0/a1/3/4/{}", "%/".repeat(number)));
    prop_oneof![like, changed, token, long, ".{0,60}"]
}

/// Nodes, and publishers, subscriptions and services of a few topics.
fn tokens() -> impl Strategy<Value = Token> {
    let interfaces = Interfaces::bundled().unwrap();
    let bool = interfaces.get("std_msgs/Bool").unwrap();
    let kinds = prop::sample::select(vec![
        EntityKind::Node,
        EntityKind::Publisher,
        EntityKind::Subscription,
        EntityKind::Service,
        EntityKind::Client,
    ]);
    let topic = prop::sample::select(vec!["/a", "/b", "/v101/cmd_vel"]);
    (kinds, 0..4_u64, topic).prop_map(move |(kind, id, topic)| {
        let node = NodeName::new("/v101", "driver").unwrap();
        let node = Token::of_node(0, "a1", id, &node);
        let topic = topic.parse().unwrap();
        match kind {
            EntityKind::Node => node,
            _ => node.with_endpoint(id, kind, Endpoint::new(&topic, &bool, Qos::default())),
        }
    })
}

#[test]
fn any_key_is_a_token_or_refused() {
    let _alone = alone();
    proptest!(|(key in keys())| {
        match bounded(key.len(), || key.parse::<Token>()) {
            Ok(token) => prop_assert_eq!(token.to_string().parse(), Ok(token)),
            Err(error) => assert_printable(&error),
        }
    });
    let long = tokens_key(0).repeat(1 << 16);
    bounded(0, || long.parse::<Token>()).unwrap_err();
}

#[test]
fn the_graph_has_the_tokens_that_were_declared_and_not_withdrawn() {
    let _alone = alone();
    let events = prop::collection::vec((keys(), prop::bool::weighted(0.7)), 0..40);
    proptest!(|(events in events)| {
        let (mut graph, mut expected, mut refused) = (Graph::default(), BTreeSet::new(), 0);
        for (key, is_declared) in &events {
            let is_token = key.parse::<Token>().is_ok();
            if !is_declared {
                prop_assert_eq!(graph.remove(key), expected.remove(key.as_str()));
            } else if is_token {
                prop_assert_eq!(graph.insert(key), Ok(expected.insert(key.as_str())));
            } else {
                prop_assert!(graph.insert(key).is_err());
                refused += 1;
            }
        }
        prop_assert_eq!(graph.dropped(), refused);
        let known: BTreeSet<_> = graph.entities().map(|(key, _)| key).collect();
        prop_assert_eq!(&known, &expected);
        for (key, entity) in graph.entities() {
            prop_assert_eq!(entity.gid, Gid::of_token(key));
            let Token { kind, endpoint, .. } = &entity.token;
            if let Some(endpoint) = endpoint {
                let mut same = graph.of_topic(*kind, &endpoint.name);
                prop_assert!(same.any(|it| it.gid == entity.gid), "{key}");
            }
        }
    });
}

#[test]
fn any_quality_of_service_that_is_read_is_written_with_the_same_meaning() {
    let _alone = alone();
    let number = || {
        prop_oneof![
            Just(String::new()),
            "[0-9]",
            any::<u64>().prop_map(|it| it.to_string())
        ]
    };
    // Around the time that ROS writes for no limit.
    let seconds = prop_oneof![number(), "922337203[56]"];
    let nanoseconds = prop_oneof![number(), "[12]?854775807"];
    let time = || (seconds.clone(), nanoseconds.clone()).prop_map(|(s, ns)| format!("{s},{ns}"));
    let kinds = [number(), number(), number(), number(), number()];
    let times = [time(), time(), time()];
    let like = (kinds, times).prop_map(|([a, b, c, d, e], [deadline, lifespan, lease])| {
        format!("{a}:{b}:{c},{d}:{deadline}:{lifespan}:{e},{lease}")
    });
    let text = prop_oneof![like, "[0-9:,]{0,60}", ".{0,40}"];
    proptest!(|(text in text)| {
        match text.parse::<Qos>() {
            Ok(qos) => prop_assert_eq!(qos.to_string().parse(), Ok(qos)),
            Err(error) => assert_printable(&error),
        }
    });
}
