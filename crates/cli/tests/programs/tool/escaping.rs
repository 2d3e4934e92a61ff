//! Names and services of peers with control characters: they forge no lines of output.

use std::time::Instant;

use jaus::codec::ServiceId;
use jaus::component::{Component, Kind};
use jaus::endpoint::Received;
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus::service::{Context, Handled, Service};
use jaus_test_kit::group::own_group;
use jaus_text::is_unprintable;

use crate::support::run;

const NAME: &str =
    "\x1b]0;title\x07\x1b[2J\x1b[8m\r\nforged line \u{202e}\u{9b}2J\u{200b}\u{2028}\u{7f}";
const URN: &str = "urn:\x1b[2J\nforged:\rforged line\u{202e}\u{200b}";
const ALL_SERVICES: &str = r#"[{"NodeRec":{"NodeID":255},"ComponentList":[{"ComponentID":255}]}]"#;

/// A service that only has a name.
struct Named;

impl Service for Named {
    fn offers(&self) -> Vec<ServiceId> {
        vec![ServiceId {
            urn: URN,
            major: 1,
            minor: 0,
        }]
    }

    fn handle_message(&mut self, _: Instant, _: &Received, _: &mut Context<'_>) -> Handled {
        Handled::No
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn names_and_services_of_peers_forge_no_lines_and_move_no_cursor() {
    let group = own_group();
    let Group::At(address) = group else {
        panic!("{group:?}");
    };
    let node = Node::start(Config::loopback(101, 1).group(group)).unwrap();
    let component = Component::builder(Kind::Vehicle, NAME)
        .component_name(NAME)
        .offer(Named)
        .attach(&node, 7)
        .unwrap();
    let address = address.to_string();
    let network = ["--loopback", "--port", "0", "--group", &address];
    let found = |command: &[&str]| {
        let arguments = [command, &network].concat();
        let run = tokio::task::block_in_place(|| run(&arguments, b""));
        // 1: the doctor has remarks.
        let expected = if command[0] == "doctor" { 0..=1 } else { 0..=0 };
        assert!(expected.contains(&run.status), "{run:?}");
        for line in run.stdout.lines().chain(run.stderr.lines()) {
            assert!(!line.contains(is_unprintable), "{command:?}: {line:?}");
            assert!(
                !line.trim_start().starts_with("forged"),
                "{command:?}: {line}"
            );
        }
        run.stdout
    };
    for command in [
        &["discover"][..],
        &["discover", "--json"],
        &["discover", "--watch", "--for", "4s"],
        &["discover", "--watch", "--json", "--for", "4s"],
        &["discover", "-vvv"],
        &["discover", "-vvv", "--log-format", "json"],
        &["monitor", "--once", "--interval", "3s"],
        &["doctor", "--for", "2s"],
        &["doctor", "--json", "--for", "2s"],
        &[
            "query",
            "101.1.7",
            "QueryIdentification",
            r#"{"QueryType":2}"#,
        ],
        &["query", "101.1.7", "QueryServices", ALL_SERVICES],
    ] {
        let shown = found(command);
        assert!(shown.contains("101.1"), "{command:?}: {shown}");
    }
    let json = found(&["discover", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["subsystems"][0]["name"], NAME, "{json}");
    drop(component);
    node.shutdown().await;
}
