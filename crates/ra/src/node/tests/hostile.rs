//! Hostile traffic is bounded and counted.

use super::*;
use jaus::endpoint::Rate;

const EVERYBODY: RaId = RaId::new(255, 255, 1, 1);
const COMMUNICATOR: RaId = RaId::new(30, 1, 35, 1);

#[test]
fn a_thousand_subsystems_are_at_most_254_and_asked_little() {
    let mut rig = Rig::new(Settings::default());
    for number in 0..1000_u32 {
        let source = RaId::new((number % 256) as u8, 1, 35, 1);
        let host = (number % 250) as u8;
        rig.hear(host, source, EVERYBODY, 0x4202, &[]);
    }
    assert!(rig.node.subsystems().count() <= 254);
    assert!(rig.sent().len() <= 254, "one question each");
    assert!(rig.count(Counter::InvalidSource) >= 6, "0 and 255");
    assert!(rig.count(Counter::SubsystemConflict) >= 3, "30 is ours");
    for _ in 0..100 {
        rig.now += Duration::from_millis(100);
        rig.node.handle_timeout(rig.now);
    }
    assert_eq!(rig.node.subsystems().count(), 0);
    assert_eq!(rig.events(), []);
}

#[test]
fn storms_of_questions_are_answered_at_a_rate() {
    let settings = Settings {
        answers: Rate::new(10, 50),
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    for _ in 0..1000 {
        rig.hear(1, RaId::new(10, 1, 1, 1), COMMUNICATOR, 0x2B03, &[]);
    }
    assert_eq!(rig.sent().len(), 50);
    assert_eq!(rig.count(Counter::AnswerRate), 950);
    rig.hear(2, RaId::new(11, 1, 1, 1), COMMUNICATOR, 0x2B03, &[]);
    assert_eq!(rig.sent().len(), 1, "others are answered");
    rig.now += Duration::from_secs(1);
    for _ in 0..100 {
        rig.hear(1, RaId::new(10, 1, 1, 1), COMMUNICATOR, 0x2B03, &[]);
    }
    assert_eq!(rig.sent().len(), 10);
}

#[test]
fn one_question_to_all_is_answered_by_each_and_that_is_limited() {
    let settings = Settings {
        answers: Rate::new(1, 3),
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    let all = RaId::new(255, 255, 255, 255);
    rig.hear(1, RaId::new(10, 1, 1, 1), all, 0x2B00, &[4]);
    assert_eq!(rig.sent().len(), 3);
}

#[test]
fn configurations_and_services_beyond_reason_are_cut() {
    let settings = Settings {
        max_components: 10,
        max_commands: 100,
        questions: Rate::new(10, 20),
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    let (them, us) = (RaId::new(10, 1, 35, 1), RaId::new(30, 1, 1, 1));
    rig.hear(1, them, EVERYBODY, 0x4202, &[]);
    let mut configuration = vec![3];
    for node in [1, 1, 0] {
        configuration.extend_from_slice(&[node, 255]);
        for component in 0..255 {
            configuration.extend_from_slice(&[component, 1]);
        }
    }
    rig.hear(1, them, us, 0x4B01, &configuration);
    let known = rig.node.subsystems().next().unwrap();
    assert_eq!(known.components().count(), 10);
    assert_eq!(rig.count(Counter::ConfigurationTooLong), 1);
    assert!(rig.sent().len() <= 21, "questions at a rate");
    let mut services = vec![1, 0, 0, 200];
    services.extend_from_slice(&[0; 200 * 6]);
    services.push(0);
    rig.hear(1, RaId::new(10, 1, 2, 1), us, 0x4B03, &services);
    assert_eq!(rig.count(Counter::ConfigurationTooLong), 2);
    for cut in 0..services.len() {
        rig.hear(1, them, us, 0x4B03, &services[..cut]);
    }
    assert!(rig.count(Counter::Malformed) >= services.len() as u64 - 1);
}

#[test]
fn subscriptions_have_a_bound_and_end_with_their_subsystem() {
    let settings = Settings {
        max_events: 5,
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    let create = [0x80, 0, 0x01, 0x4B, 1, 1, 0, 0, 0, 2];
    let mut responses = Vec::new();
    for instance in [1, 2, 3, 4, 5, 6, 1] {
        let source = RaId::new(10, 1, 1, instance);
        rig.hear(1, source, EVERYBODY, 0x4202, &[]);
        rig.hear(1, source, COMMUNICATOR, 0x01F0, &create);
        let sent = rig.sent();
        let confirmed = sent.iter().find(|sent| sent.code == 0x01F3).unwrap();
        responses.push((confirmed.data[4], *confirmed.data.last().unwrap()));
    }
    assert_eq!(
        responses,
        [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (0, 3), (0, 0)],
        "the sixth is refused, the first is there already"
    );
    rig.hear(
        1,
        RaId::new(10, 1, 1, 2),
        COMMUNICATOR,
        0x01F2,
        &[3, 0, 1, 0x4B, 1],
    );
    assert_eq!(rig.sent().pop().unwrap().data.last(), Some(&0));
    rig.now += Duration::from_secs(6);
    rig.node.handle_timeout(rig.now);
    rig.sent();
    rig.node.withdraw(rig.now, 30);
    assert_eq!(rig.sent(), [], "nobody is left who wants to know");
}

#[test]
fn messages_that_nobody_polls_are_bounded() {
    let settings = Settings {
        queue_limit: 10,
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    let driver = RaId::new(30, 1, 33, 1);
    for _ in 0..100 {
        rig.hear(1, RaId::new(10, 1, 1, 1), driver, 0x0405, &[0, 0]);
    }
    assert_eq!(rig.count(Counter::EventQueueFull), 90);
    assert_eq!(rig.events().len(), 10);
}
