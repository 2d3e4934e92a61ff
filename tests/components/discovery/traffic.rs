//! Discovery traffic: on average at most one packet per second and component.

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{QueryIdentification, ReportIdentification};

use crate::discovery::world::{World, stack};

fn most_datagrams_in_an_idle_hour(components: u16) -> u64 {
    let mut world = World::new();
    let places: Vec<_> = (1..=components)
        .map(|subsystem| world.start(stack(JausId::new(subsystem, 1, 1), "idle", Vec::new())))
        .collect();
    world.run(Duration::from_secs(300));
    for place in &places {
        let known = world.stack(*place).directory().len();
        assert_eq!(known, usize::from(components), "everybody knows everybody");
    }
    let before: Vec<_> = places.iter().map(|place| world.datagrams(*place)).collect();
    world.run(Duration::from_secs(3600));
    let sent = places
        .iter()
        .zip(before)
        .map(|(place, before)| world.datagrams(*place) - before);
    sent.max().unwrap_or_default()
}

#[test]
fn an_idle_component_sends_at_most_one_packet_a_second() {
    for components in [1, 2, 3, 5, 12] {
        let sent = most_datagrams_in_an_idle_hour(components);
        println!("{components} components: at most {sent} datagrams in an hour");
        assert!(
            sent <= 3600,
            "{components} components: {sent} datagrams in an hour"
        );
    }
}

#[test]
fn a_component_that_is_alone_calls_every_five_seconds() {
    let sent = most_datagrams_in_an_idle_hour(1);
    assert!((650..=800).contains(&sent), "{sent} datagrams in an hour");
}

#[test]
fn a_flood_of_queries_is_answered_up_to_the_limit_of_a_hundred_a_second() {
    let mut world = World::new();
    world.start(stack(JausId::new(101, 1, 1), "flooded", Vec::new()));
    let puppet = world.puppet(JausId::new(9, 1, 1));
    world.run(Duration::from_secs(1));
    world.received(puppet);
    let mut answers = 0;
    for round in 0..1000_u32 {
        // The queries vary; otherwise the endpoint would drop them as duplicates.
        let query_type = u8::try_from(2 + round % 3).unwrap();
        let query = QueryIdentification {
            query_type: query_type.into(),
        };
        world.say(puppet, JausId::EVERYONE, &query);
        world.run(Duration::from_millis(2));
        answers += world.received_as::<ReportIdentification>(puppet).len();
    }
    assert!(
        (400..=256 + 200).contains(&answers),
        "{answers} answers to 1000 queries in 2 s"
    );
    assert_eq!(QueryIdentification::CODE, 0x2B00);
}
