//! JAUS clients query RA vector drivers: with octets of components based on OpenJAUS's library.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::messages::mobility::{
    QueryGlobalVector, QueryLocalVector, ReportGlobalVector, ReportLocalVector,
};
use jaus::service::{Event, Patience, Question};
use jaus_ra::gateway::Settings;

use crate::gateway::world::{World, subsystem};
use jaus_test_kit::rover::bytes;

const GLOBAL: JausId = JausId::new(20, 1, 34);
const LOCAL: JausId = JausId::new(20, 1, 44);

/// Sends a JAUS client's query to an RA driver, and the driver's report back. Returns the data of
/// the query that reaches the driver, and the report that reaches the client.
fn ask<R: jaus::codec::Message>(
    driver: JausId,
    query: &impl jaus::codec::Message,
    (code, report): (u16, &str),
) -> (Bytes, R) {
    let mut world = World::new(Settings::default());
    let parts = [(34, 1, "Global"), (44, 1, "Local")];
    let ra = world.add_ra(subsystem(20, "Sim", &parts), None);
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));
    let (now, payload) = (world.now, query.encode().unwrap());
    let stack = &mut world.jaus[operator].stack;
    stack.ask(
        now,
        driver,
        Question::new(payload, R::CODE),
        Patience::default(),
    );
    world.settle();
    let asked = world.ra_heard(ra, code - 0x2000).remove(0);
    world.ra_says(ra, &asked.answer(code, bytes(report)));
    let answers = world.jaus[operator].events.iter();
    let mut answers = answers.filter_map(|event| match event {
        Event::Answer(_, answer) => answer.clone().ok(),
        _ => None,
    });
    (asked.data, R::decode(&answers.next().unwrap()).unwrap())
}

#[test]
fn a_local_vector_is_asked_for_without_fields_and_told() {
    let query = QueryLocalVector {
        presence_vector: 0xFF,
    };
    let (asked, told): (_, ReportLocalVector) = ask(LOCAL, &query, (0x4408, "661b0d8073e1"));
    assert!(asked.is_empty(), "{asked:?}");
    assert!((told.speed_m_per_s() - 2.0).abs() < 0.01, "{told:?}");
    let heading = told.heading_rad().unwrap();
    assert!((heading + 0.75).abs() < 0.001, "{heading}");
}

#[test]
fn of_a_global_vector_the_wanted_fields_alone_are_told() {
    let query = QueryGlobalVector {
        presence_vector: 0b101,
    };
    let report = (0x4407, "1f140091c2f5b8ed321304dbf7");
    let (_, told): (_, ReportGlobalVector) = ask(GLOBAL, &query, report);
    assert!((told.speed_m_per_s().unwrap() - 3.05).abs() < 0.01);
    assert!((told.heading_rad().unwrap() - 1.25).abs() < 0.001);
    assert_eq!((told.altitude, told.roll, told.pitch), (None, None, None));
}
