//! Recorded exchanges between OpenJAUS 3.3.1 node managers, octet by octet.

use super::*;

const THEIR_MANAGER: RaId = RaId::new(10, 1, 1, 1);
const THEIR_COMMUNICATOR: RaId = RaId::new(10, 1, 35, 1);
const OUR_MANAGER: RaId = RaId::new(30, 1, 1, 1);
const OUR_COMMUNICATOR: RaId = RaId::new(30, 1, 35, 1);
const EVERYBODY: RaId = RaId::new(255, 255, 1, 1);

fn name(field: u8, name: &str) -> Vec<u8> {
    let mut data = vec![field, 0, 0, 0];
    data.extend_from_slice(name.as_bytes());
    data.resize(84, 0);
    data
}

#[test]
fn the_questions_of_a_node_manager_get_the_answers_that_another_gave() {
    let mut rig = Rig::new(Settings::default());
    let mut ask = |to, code, data: &[u8]| {
        rig.hear(1, THEIR_MANAGER, to, code, data);
        let answers = rig.sent();
        let [answer] = &answers[..] else {
            panic!("{answers:?}")
        };
        assert_eq!((answer.source, answer.destination), (to, THEIR_MANAGER));
        (answer.code, answer.data.to_vec())
    };
    let communicator = OUR_COMMUNICATOR;
    assert_eq!(
        ask(communicator, 0x2B00, &[2]),
        (0x4B00, name(2, "Vehicle 30"))
    );
    let configuration = [1, 1, 4, 1, 1, 35, 1, 33, 1, 38, 1];
    assert_eq!(
        ask(communicator, 0x2B01, &[2]),
        (0x4B01, configuration.to_vec())
    );
    let create = [0x80, 0, 0x01, 0x4B, 1, 1, 0, 0, 0, 2];
    let (code, confirmed) = ask(communicator, 0x01F0, &create);
    assert_eq!(
        (code, &confirmed[1..]),
        (0x01F3, &[0, 1, 0x4B, 0, 0, 0, 0][..])
    );
    assert_eq!(confirmed[0] & 1, 1, "the rate is there");
    assert_eq!(ask(OUR_MANAGER, 0x2B00, &[3]), (0x4B00, name(3, "Main")));
    assert_eq!(
        ask(OUR_MANAGER, 0x2B00, &[4]),
        (0x4B00, name(4, "Node Manager"))
    );
    let driver = RaId::new(30, 1, 33, 1);
    assert_eq!(ask(driver, 0x2B00, &[4]), (0x4B00, name(4, "Driver")));
    let services = [
        1, 33, 0, 1, 0x02, 0x24, 0, 0, 0, 0, 2, 0x02, 0x44, 0x7F, 0, 0, 0, 0x04, 0x44, 0, 0, 0, 0,
    ];
    assert_eq!(ask(driver, 0x2B03, &[]), (0x4B03, services.to_vec()));
    assert_eq!(ask(driver, 0x2202, &[]), (0x4202, vec![]));
    assert_eq!(ask(OUR_MANAGER, 0x2B01, &[3]).0, 0x4B01);

    let mut less = vehicle(30);
    less.nodes[0].components.pop();
    rig.node.announce(rig.now, less).unwrap();
    rig.now += Duration::from_millis(250);
    rig.node.handle_timeout(rig.now);
    let told = rig.sent();
    let [event] = &told[..] else {
        panic!("{told:?}")
    };
    assert_eq!(
        (event.source, event.destination),
        (communicator, THEIR_MANAGER)
    );
    let expected = [0, 1, 0x4B, 0, 9, 0, 0, 0, 1, 1, 3, 1, 1, 35, 1, 33, 1];
    assert_eq!((event.code, &event.data[..]), (0x41F1, &expected[..]));
    rig.node.withdraw(rig.now, 30);
    let goodbye = rig.sent().pop().unwrap();
    let expected = [0, 1, 0x4B, 1, 1, 0, 0, 0, 0];
    assert_eq!((goodbye.code, &goodbye.data[..]), (0x41F1, &expected[..]));
}

/// The queries sent: destination, code and data.
fn asked(rig: &mut Rig) -> Vec<(RaId, u16, Vec<u8>)> {
    let sent = rig.sent().into_iter();
    let asked = sent.inspect(|message| assert_eq!(message.source, OUR_MANAGER));
    asked
        .map(|message| (message.destination, message.code, message.data.to_vec()))
        .collect()
}

#[test]
fn a_node_manager_is_asked_what_another_asked_it_in_the_same_order() {
    let mut rig = Rig::new(Settings::default());
    rig.hear(1, THEIR_COMMUNICATOR, EVERYBODY, 0x4202, &[]);
    assert_eq!(asked(&mut rig), [(THEIR_COMMUNICATOR, 0x2B00, vec![2])]);
    let (them, us) = (THEIR_COMMUNICATOR, OUR_MANAGER);
    rig.hear(1, them, us, 0x4B00, &name(2, "OJ_a"));
    let create = vec![0x80, 0, 0x01, 0x4B, 1, 1, 0, 0, 0, 2];
    assert_eq!(
        asked(&mut rig),
        [(them, 0x2B01, vec![2]), (them, 0x01F0, create)]
    );
    rig.hear(1, them, us, 0x4B01, &[1, 1, 2, 1, 1, 35, 1]);
    rig.hear(1, them, us, 0x01F3, &[0xFF, 0, 1, 0x4B, 0, 0, 0, 0]);
    assert_eq!(
        asked(&mut rig),
        [
            (THEIR_MANAGER, 0x2B00, vec![3]),
            (THEIR_MANAGER, 0x2B00, vec![4]),
            (them, 0x2B00, vec![4]),
            (THEIR_MANAGER, 0x2B03, vec![]),
            (them, 0x2B03, vec![]),
        ]
    );
    assert_eq!(rig.events(), []);
    rig.hear(1, THEIR_MANAGER, us, 0x4B00, &name(3, "OJNode_a"));
    for (id, of) in [
        (THEIR_MANAGER, "OpenJAUS Node Manager"),
        (them, "OpenJAUS Communicator"),
    ] {
        rig.hear(1, id, us, 0x4B00, &name(4, of));
        rig.hear(1, id, us, 0x4B03, &[1, 0, 0, 1, 0x00, 0x2B, 0, 0, 0, 0, 0]);
    }
    let events = rig.events();
    let [Event::Appeared(seen)] = &events[..] else {
        panic!("{events:?}")
    };
    assert_eq!(
        (seen.name.as_str(), seen.nodes[0].name.as_str()),
        ("OJ_a", "OJNode_a")
    );
    let inputs = vec![Command {
        code: 0x2B00,
        presence: 0,
    }];
    assert_eq!(seen.nodes[0].components[0].services[0].inputs, inputs);

    let with_driver = [0, 1, 0x4B, 0, 9, 0, 0, 0, 1, 1, 3, 1, 1, 35, 1, 33, 1];
    rig.hear(1, them, us, 0x41F1, &with_driver);
    let driver = RaId::new(10, 1, 33, 1);
    assert_eq!(
        asked(&mut rig),
        [(driver, 0x2B00, vec![4]), (driver, 0x2B03, vec![])]
    );
    rig.hear(1, them, us, 0x41F1, &[0, 1, 0x4B, 0, 1, 0, 0, 0, 0]);
    assert_eq!(rig.events(), [Event::Lost(10)]);
}

#[test]
fn short_names_are_names() {
    let mut rig = Rig::new(Settings::default());
    rig.hear(1, THEIR_COMMUNICATOR, EVERYBODY, 0x4202, &[]);
    let short = [2, 0, 0, 0, b'a', b'b', 0, b'x'];
    rig.hear(1, THEIR_COMMUNICATOR, OUR_MANAGER, 0x4B00, &short);
    assert_eq!(rig.node.subsystems().next().unwrap().name, "ab");
}

#[test]
fn who_is_silent_is_asked_again_and_then_left_for_a_while() {
    let mut rig = Rig::new(Settings::default());
    let mut questions = 0;
    for _ in 0..200 {
        rig.hear(1, THEIR_COMMUNICATOR, EVERYBODY, 0x4202, &[]);
        rig.now += Duration::from_millis(100);
        rig.node.handle_timeout(rig.now);
        let sent = rig.sent();
        questions += sent.iter().filter(|sent| sent.code != 0x4202).count();
    }
    assert!((12..=40).contains(&questions), "{questions} in 20 s");
    assert_eq!(rig.events(), []);
}

#[test]
fn what_the_node_does_not_answer_is_for_the_owner() {
    let mut rig = Rig::new(Settings::default());
    let driver = RaId::new(30, 1, 33, 1);
    for (code, data) in [
        (0x0405, &[0, 0][..]),
        (0x2402, &[0xFF]),
        (0x01F0, &[0, 7, 0x02, 0x44, 0]),
        (0x01F2, &[2, 7, 9]),
        (0x41F1, &[0, 2, 0x44, 0, 0, 0, 0, 0]),
        (0x01F3, &[0, 0, 2, 0x44, 0, 0]),
        (0x0008, &[0; 8]),
    ] {
        rig.hear(1, THEIR_MANAGER, driver, code, data);
        let events = rig.events();
        let [Event::Message(message)] = &events[..] else {
            panic!("{code:04X}h: {events:?}")
        };
        assert_eq!((message.code, &message.data[..]), (code, data));
    }
    assert_eq!(rig.sent(), []);
}

#[test]
fn events_of_other_kinds_are_refused_by_managers() {
    let mut rig = Rig::new(Settings::default());
    for (create, response) in [
        (&[0, 7, 0x02, 0x44, 1][..], 5),
        (&[0, 7, 0x01, 0x4B, 0], 1),
        (&[0x80, 7, 0x01, 0x4B, 1, 1, 0, 0, 0, 9], 4),
    ] {
        rig.hear(1, THEIR_MANAGER, OUR_MANAGER, 0x01F0, create);
        let answer = rig.sent().pop().unwrap();
        assert_eq!((answer.data[1], answer.data.last()), (7, Some(&response)));
    }
    rig.hear(1, THEIR_MANAGER, OUR_MANAGER, 0x01F0, &[0x80, 7]);
    assert_eq!(rig.count(Counter::Malformed), 1);
    assert_eq!(rig.count(Counter::EventRefused), 3);
}

#[test]
fn who_knows_us_from_before_is_told_what_we_show_without_asking() {
    let mut rig = Rig::new(Settings::default());
    let mut told = Vec::new();
    for step in 0..100 {
        rig.hear(1, THEIR_COMMUNICATOR, EVERYBODY, 0x4202, &[]);
        if step == 1 {
            let configuration = [1, 1, 2, 1, 1, 35, 1];
            rig.hear(1, THEIR_COMMUNICATOR, OUR_MANAGER, 0x4B01, &configuration);
        }
        if step == 70 {
            let mut less = vehicle(30);
            less.nodes[0].components.clear();
            rig.node.announce(rig.now, less).unwrap();
        }
        rig.now += Duration::from_millis(100);
        rig.node.handle_timeout(rig.now);
        told.extend(rig.sent().into_iter().filter(|sent| sent.code == 0x4B01));
    }
    let whole = Bytes::from_static(&[1, 1, 4, 1, 1, 35, 1, 33, 1, 38, 1]);
    let less = Bytes::from_static(&[1, 1, 2, 1, 1, 35, 1]);
    let expected =
        [whole, less].map(|data| Message::new(OUR_COMMUNICATOR, THEIR_MANAGER, 0x4B01, data));
    assert_eq!(told, expected);
}
