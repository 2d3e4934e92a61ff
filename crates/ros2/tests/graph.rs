//! Keys, liveliness tokens, quality of service and attachments, compared with the examples of rmw_zenoh's
//! documentation (`docs/design.md`, version 0.2.5).
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use std::time::Duration;

use jaus_ros2::graph::{
    Durability, Endpoint, EntityKind, Graph, History, NodeName, Reliability, Token, topic_key,
};
use jaus_ros2::{Attachment, Gid, Interfaces, Qos, TopicName};
use proptest::prelude::*;
use zenoh::key_expr::KeyExpr;

const CHATTER: &str = "std_msgs::msg::dds_::String_/\
    RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
const LISTENER: &str = "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener";

fn talker() -> String {
    format!(
        "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/{CHATTER}/::,7:,:,:,,"
    )
}

fn topic(name: &str) -> TopicName {
    name.parse().unwrap()
}

#[test]
fn a_topic_has_the_key_of_the_documentation() {
    let interfaces = Interfaces::bundled().unwrap();
    let string = interfaces.get("std_msgs/msg/String").unwrap();
    let key = topic_key(0, &topic("/chatter"), &string);
    assert_eq!(key, format!("0/chatter/{CHATTER}"));
    let key = topic_key(2, &topic("/robot1/chatter"), &string);
    assert_eq!(key, format!("2/robot1/chatter/{CHATTER}"));
}

#[test]
fn tokens_are_written_as_in_the_documentation() {
    let session = "aac3178e146ba6f1fc6e6a4085e77f21";
    let name = NodeName::new("/", "listener").unwrap();
    assert_eq!(Token::of_node(2, session, 0, &name).to_string(), LISTENER);

    let session = "8b20917502ee955ac4476e0266340d5c";
    let node = Token::of_node(2, session, 0, &NodeName::new("/", "talker").unwrap());
    let string = Interfaces::bundled()
        .unwrap()
        .get("std_msgs/String")
        .unwrap();
    let qos = Qos::default().with_depth(7);
    let endpoint = Endpoint::new(&topic("/chatter"), &string, qos);
    let publisher = node.with_endpoint(10, EntityKind::Publisher, endpoint);
    assert_eq!(publisher.to_string(), talker());
}

#[test]
fn tokens_of_all_kinds_are_read() {
    let token: Token = talker().parse().unwrap();
    assert_eq!((token.domain, token.node_id, token.id), (2, 0, 10));
    assert_eq!(token.kind, EntityKind::Publisher);
    assert_eq!(
        (token.namespace.as_str(), token.node.as_str()),
        ("/", "talker")
    );
    let endpoint = token.endpoint.unwrap();
    assert_eq!(endpoint.name, "/chatter");
    assert_eq!(endpoint.qos, Qos::default().with_depth(7));
    for (kind, chunk) in [
        (EntityKind::Subscription, "MS"),
        (EntityKind::Service, "SS"),
        (EntityKind::Client, "SC"),
    ] {
        let key = talker()
            .replace("MP", chunk)
            .replace("%/talker", "%a%b/talker");
        let token: Token = key.parse().unwrap();
        assert_eq!(token.kind, kind);
        assert_eq!(token.node_name(), "/a/b/talker");
        assert_eq!(token.to_string(), key);
    }
}

#[test]
fn the_gid_is_the_hash_that_another_implementation_computes() {
    // Computed with the package xxhash of Python.
    for (key, gid) in [
        (LISTENER, "49877999dacb858702d11ac823785912"),
        (&talker(), "ac170f31eadcd9ff0cd86d7a17907d1c"),
    ] {
        assert_eq!(Gid::of_token(key).to_string(), gid);
    }
    for (length, gid) in [
        (1, "1f4e961eb632c6e63468f15a70af6fa9"),
        (8, "120f8813b302b742333537af3732c2da"),
        (9, "98db86792d6b64c0ade0f25fbcf53fb4"),
        (16, "30632ff13f158e3e4b8c1b9b80fc581f"),
        (17, "abef960594c9acc38d3acaa5388c0711"),
        (63, "65b8d35e2cdd0212ddd6b3af81df37db"),
        (128, "1eae6dfcb199544c25df17c67a157fa8"),
        (129, "6a2b447af668c41ac45baf54984abb8e"),
        (240, "bc16eeea02027579309db04303fc81ee"),
        (241, "11c2b5f56a900abb1ebd6573587e1a4c"),
        (512, "625ca406a2879816e6226c68180b82d9"),
        (1024, "a86571126e406a5ec473794e8ff4e8a0"),
        (1025, "f5c3fa71475380c1f7bd4d799157fd3c"),
        (2048, "efaf4c77198f939827f5f71238a3c1de"),
    ] {
        let letters = ('a'..='z').cycle().take(length);
        let key = String::from_iter(letters);
        assert_eq!(Gid::of_token(&key).to_string(), gid, "{length}");
    }
    // Written otherwise than this crate would write it: the key counts as it was declared.
    let mut graph = Graph::default();
    let key = talker().replace("::,7:,:,:,,", "1:2:1,7:9223372036,854775807:,:1,,");
    graph.insert(&key).unwrap();
    let gids: Vec<_> = graph.entities().map(|(_, entity)| entity.gid).collect();
    assert_eq!(gids, [Gid::of_token(&key)]);
}

#[test]
fn malformed_tokens_are_refused_and_counted() {
    let mut graph = Graph::default();
    let talker = talker();
    for key in [
        "",
        "@ros2_lv/2",
        "@other/2/a/0/0/NN/%/%/listener",
        "@ros2_lv/x/a/0/0/NN/%/%/listener",
        "@ros2_lv/2/a/x/0/NN/%/%/listener",
        "@ros2_lv/2/a/0/0/XX/%/%/listener",
        "@ros2_lv/2/a/0/0/NN/%/%",
        "@ros2_lv/2/a/0/0/NN//%/listener",
        talker.trim_end_matches("/::,7:,:,:,,"),
        &"@ros2_lv/".repeat(300),
    ] {
        let error = graph.insert(key).unwrap_err().to_string();
        assert!(error.contains("is not a liveliness token"), "{error}");
    }
    assert_eq!(graph.dropped(), 10);
    assert_eq!(graph.entities().count(), 0);
}

#[test]
fn the_graph_knows_who_publishes_a_topic() {
    let mut graph = Graph::default();
    assert_eq!(graph.insert(&talker()), Ok(true));
    assert_eq!(graph.insert(&talker()), Ok(false));
    assert_eq!(graph.insert(LISTENER), Ok(true));
    let publishers = |graph: &Graph| graph.of_topic(EntityKind::Publisher, "/chatter").count();
    assert_eq!(publishers(&graph), 1);
    assert_eq!(
        graph.of_topic(EntityKind::Subscription, "/chatter").count(),
        0
    );
    assert!(graph.remove(&talker()));
    assert!(!graph.remove(&talker()));
    assert_eq!(publishers(&graph), 0);
}

#[test]
fn no_entity_is_left_out_for_its_quality_of_service() {
    for qos in [
        "4:4:3,7:,:,:5,,",
        "9:,7:,:,:,,",
        "::7:,:,:,,",
        "x",
        "::,x:,:,:,,",
    ] {
        let mut graph = Graph::default();
        let key = talker().replace("::,7:,:,:,,", qos);
        assert_eq!(graph.insert(&key), Ok(true), "{qos}");
        let publishers = graph.of_topic(EntityKind::Publisher, "/chatter");
        assert_eq!(publishers.count(), 1, "{qos}");
    }
    let best_available: Qos = "4:4:0,7:,:,:5,,".parse().unwrap();
    assert_eq!(best_available, Qos::default().with_depth(7));
}

/// A token like that of the talker, with these numbers of its session and in it.
fn numbered(session: u32, number: u32) -> String {
    talker()
        .replace("8b20917502ee955ac4476e0266340d5c", &format!("{session:x}"))
        .replace("/0/10/MP", &format!("/0/{number}/MP"))
}

#[test]
fn the_tokens_of_a_topic_have_a_bound_that_leaves_other_topics_alone() {
    let mut graph = Graph::default();
    let key = |number: u32| numbered(1 + number / 256, number);
    for number in 0..1025 {
        assert_eq!(graph.insert(&key(number)), Ok(number < 1024), "{number}");
    }
    assert_eq!(graph.dropped(), 1);
    assert_eq!(
        graph.insert(&talker().replace("%chatter", "%other")),
        Ok(true)
    );
    assert!(graph.remove(&key(0)));
    assert_eq!(graph.insert(&key(1024)), Ok(true));
}

#[test]
fn a_session_leaves_room_for_the_tokens_of_others() {
    let mut graph = Graph::default();
    for number in 0..300 {
        let is_room = number < 256;
        assert_eq!(graph.insert(&numbered(1, number)), Ok(is_room), "{number}");
    }
    // The id of another session may begin alike.
    for session in [2, 0x10, 0x1f] {
        assert_eq!(graph.insert(&numbered(session, 1)), Ok(true));
    }
    let of_topic = |number: u32, session: u32| {
        let topic = format!("%topic{}", number / 100);
        numbered(session, number).replace("%chatter", &topic)
    };
    let mut graph = Graph::default();
    for number in 0..5000 {
        let is_room = number < 4096;
        let inserted = graph.insert(&of_topic(number, 1));
        assert_eq!(inserted, Ok(is_room), "{number}");
    }
    assert_eq!(graph.insert(&of_topic(0, 2)), Ok(true));
}

#[test]
fn quality_of_service_has_the_text_of_rmw_zenoh() {
    let mut every = Qos::sensor();
    every.durability = Durability::TransientLocal;
    every.history = History::KeepAll;
    every.deadline = Some(Duration::from_secs(5));
    every.lifespan = Some(Duration::new(60, 3000));
    every.lease = Some(Duration::from_millis(1500));
    for (qos, text) in [
        (Qos::default(), "::,10:,:,:,,"),
        (Qos::default().with_depth(42), "::,:,:,:,,"),
        (Qos::sensor(), "2::,5:,:,:,,"),
        (every, "2:1:2,5:5,0:60,3000:,1,500000000"),
    ] {
        assert_eq!(qos.to_string(), text);
        assert_eq!(text.parse(), Ok(qos));
    }
    // What rmw_zenoh leaves out may be written.
    let explicit: Qos = "1:2:1,10:9223372036,854775807:,:1,,".parse().unwrap();
    assert_eq!(explicit, Qos::default());
    // The nanoseconds of no limit may have a second of its seconds.
    let carried: Qos = "1:2:1,10:9223372035,1854775807:,:1,,".parse().unwrap();
    assert_eq!(carried, Qos::default());
    assert_eq!(explicit.reliability, Reliability::Reliable);
}

#[test]
fn an_attachment_is_two_numbers_and_a_gid_with_its_length() {
    let attachment = Attachment {
        sequence: 258,
        stamp: -1,
        gid: Gid(std::array::from_fn(|index| u8::try_from(index).unwrap())),
    };
    let octets = attachment.encode();
    let (numbers, gid) = octets.split_at(16);
    assert_eq!(numbers, [&[2, 1, 0, 0, 0, 0, 0, 0], &[255; 8][..]].concat());
    assert_eq!(
        gid,
        [16, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]
    );
    assert_eq!(Attachment::decode(&octets), Ok(attachment));
    let long = [&octets[..], &[0]].concat();
    for malformed in [&octets[..32], &long, &[], &[0; 33]] {
        let error = Attachment::decode(malformed).unwrap_err().to_string();
        assert!(error.contains("rmw_zenoh 0.2.4"), "{error}");
    }
}

#[test]
fn names_follow_the_rules_of_ros() {
    for name in ["/odom", "/v101/cmd_vel", "/a/_b/C1", "/a__b"] {
        assert_eq!(topic(name).as_str(), name);
    }
    let long = format!("/{}", "a".repeat(247));
    for (name, part) in [
        ("odom", "begin it with /"),
        ("", "begin it with /"),
        ("/", "ends with /"),
        ("/odom/", "ends with /"),
        ("/a//b", "two / in a row"),
        ("/1a", "begins with a digit"),
        ("/a/2", "begins with a digit"),
        ("/a-b", "only letters"),
        ("/a*", "only letters"),
        ("/é", "only letters"),
        (long.as_str(), "longer than 247"),
    ] {
        let error = name.parse::<TopicName>().unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let node = NodeName::new("/v101", "bridge").unwrap();
    assert_eq!(node.to_string(), "/v101/bridge");
    assert_eq!(NodeName::new("/", "bridge").unwrap().to_string(), "/bridge");
    for (namespace, name) in [
        ("", "a"),
        ("v101", "a"),
        ("/v101/", "a"),
        ("/", ""),
        ("/", "a/b"),
    ] {
        NodeName::new(namespace, name).unwrap_err();
    }
}

proptest! {
    #[test]
    fn every_name_that_is_accepted_makes_keys_that_zenoh_accepts(
        name in "(/[a-z_][a-z_0-9]{0,8}){1,3}|/.{0,20}",
        namespace in "/|(/[a-z_][a-z_0-9]{0,8}){1,3}|/.{0,20}",
        node in "[a-z_][a-z_0-9]{0,8}|.{0,20}",
    ) {
        let interfaces = Interfaces::bundled().unwrap();
        let bool = interfaces.get("std_msgs/Bool").unwrap();
        let (Ok(name), Ok(node)) = (name.parse(), NodeName::new(&namespace, &node)) else {
            return Ok(());
        };
        let token = Token::of_node(7, "a1b2", 3, &node);
        let endpoint = Endpoint::new(&name, &bool, Qos::sensor());
        let publisher = token.with_endpoint(4, EntityKind::Publisher, endpoint);
        for token in [token, publisher] {
            KeyExpr::try_from(token.to_string()).unwrap();
            prop_assert_eq!(token.to_string().parse(), Ok(token));
        }
        KeyExpr::try_from(topic_key(7, &name, &bool)).unwrap();
    }
}
