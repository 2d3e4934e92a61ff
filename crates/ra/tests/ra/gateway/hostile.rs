//! Hostile and malformed RA traffic: bounded, counted, and without effect on others.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus_ra::gateway::{Counter, Settings};
use jaus_ra::{Message, RaId};

use crate::gateway::world::{World, subsystem};
use jaus_test_kit::rover::{Rover, SUBSYSTEM, datagram};

fn stranger(host: u16) -> SocketAddr {
    let [high, low] = host.to_be_bytes();
    SocketAddr::from(([10, 78, high, low], 3794))
}

#[test]
fn a_thousand_subsystems_with_a_thousand_components_leave_the_gateway_small_and_at_work() {
    let mut world = World::new(Settings {
        max_components: 40,
        ..Settings::default()
    });
    let parts = [(33, 1, "Driver")];
    world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(Rover::new()));
    world.run(Duration::from_secs(5));
    for host in 0..1000 {
        let subsystem = (host % 254 + 1) as u8;
        for component in 1..60 {
            let source = RaId::new(subsystem, 1, component, 1);
            let all = RaId::new(255, 255, 1, 1);
            let (now, from) = (world.now, stranger(host));
            let heartbeat = datagram(RaId::new(subsystem, 1, 35, 1), all, 0x4202, &[]);
            world.gateway.handle_datagram(now, from, heartbeat);
            let query = datagram(source, RaId::new(250, 1, 32, 1), 0x2002, &[]);
            world.gateway.handle_datagram(now, from, query);
        }
    }
    world.run(Duration::from_secs(60));
    assert!(world.attached().len() <= 41, "{}", world.attached().len());
    assert!(world.attached().contains(&"20.1.33".to_owned()));
}

#[test]
fn rubbish_from_a_component_that_is_known_is_refused_and_counted() {
    let mut world = World::new(Settings::default());
    let parts = [(33, 1, "Driver")];
    let ra = world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(Rover::new()));
    world.run(Duration::from_secs(5));
    let driver = RaId::new(SUBSYSTEM, 1, 33, 1);
    let us = RaId::new(250, 1, 32, 1);
    // Every code with mostly invalid data.
    for code in 0..=u16::MAX {
        // The nodes answer these messages themselves.
        if matches!(code, 0x4B00..=0x4B03 | 0x4202 | 0x41F1) {
            continue;
        }
        let data = Bytes::from(vec![0xFF; usize::from(code % 7)]);
        world.ra_says(ra, &Message::new(driver, us, code, data));
        if code % 1000 == 0 {
            world.run(Duration::from_millis(500));
        }
    }
    world.run(Duration::from_secs(2));
    let refused = [
        Counter::NoCounterpart,
        Counter::NotConverted,
        Counter::Unasked,
    ];
    let refused: u64 = refused.map(|it| world.count(it)).iter().sum();
    assert!(refused > 10_000, "{:?}", world.gateway.counters());
    assert_eq!(world.attached().len(), 4, "{:?}", world.attached());
}

#[test]
fn an_operator_who_floods_a_component_with_questions_is_refused_and_others_are_not() {
    let mut world = World::new(Settings::default());
    let parts = [(33, 1, "Driver"), (38, 1, "Pose")];
    let ra = world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(Rover::new()));
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));
    world.ra[ra].rover.as_mut().unwrap().mute = true;
    let peer = jaus::address::JausId::new(20, 1, 38);
    for presence_vector in 0..1000 {
        let query = jaus::messages::mobility::QueryGlobalPose { presence_vector };
        world.tell(operator, peer, &query);
    }
    assert!(world.count(Counter::TooManyWaiting) >= 900);
    assert!(world.count(Counter::QueriesToRa) < 10);
}
