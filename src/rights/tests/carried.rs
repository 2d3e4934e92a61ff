//! Messages inside messages.

use super::*;

const WRENCH: &[u8] = b"\x05\x04\0\0";
const VELOCITY: &[u8] = b"\x04\x24\0\0";
const STOP: &[u8] = b"\x06\0\x01\0";

#[test]
fn a_command_inside_an_event_needs_the_same_rights() {
    let check = |rules: &str| check_octets(rules, &command_event(WRENCH));
    assert_eq!(check(""), Err(Refusal::Command));
    assert_eq!(check("command"), Ok(()));
    assert_eq!(check("command only=SetWrenchEffort"), Ok(()));
    assert_eq!(check("command only=SetTravelSpeed"), Err(Refusal::Excluded));
    assert_eq!(
        check("command except=SetWrenchEffort"),
        Err(Refusal::Excluded)
    );
    let check = |rules: &str| check_octets(rules, &event(VELOCITY));
    assert_eq!(check(""), Ok(()));
    assert_eq!(check("except=QueryVelocityState"), Err(Refusal::Excluded));
}

#[test]
fn the_elements_of_a_list_and_the_messages_of_a_mission_are_asked_in_turn() {
    let request = request(255).encode().unwrap();
    let shutdown = Shutdown.encode().unwrap();
    let speed = SetTravelSpeed::default().encode().unwrap();
    for carrier in [element, mission] {
        let check = |rules: &str, message: &[u8]| check_octets(rules, &carrier(message));
        assert_eq!(check("", &speed), Err(Refusal::Command));
        assert_eq!(check("command", &speed), Ok(()));
        assert_eq!(check("command", &request), Err(Refusal::Control));
        let refused = Refusal::Authority {
            asked: 255,
            most: 9,
        };
        assert_eq!(check("control=9", &request), Err(refused));
        assert_eq!(check("control=255", &shutdown), Err(Refusal::Configure));
        assert_eq!(check("command", b"\xBC\xDA"), Err(Refusal::Unknown));
        assert_eq!(
            check("command except=SetTravelSpeed", &speed),
            Err(Refusal::Excluded)
        );
        // One inside the other, deeper than any that is of use.
        let nested = (0..20).fold(speed.to_vec(), |inner, _| carrier(&inner));
        assert_eq!(check("command", &nested), Err(Refusal::Hidden));
        // A message that ends too early is refused.
        let whole = carrier(&speed);
        let everything = Rules::everything();
        for end in 2..whole.len() - 3 {
            let cut = frame(whole[..end].to_vec());
            let command: Rules = "command".parse().unwrap();
            assert!(command.check(&cut, &Table::default()).is_err(), "{end}");
            assert_eq!(everything.check(&cut, &Table::default()), Ok(()), "{end}");
        }
        assert!(Table::default().is_recorded(&carrier(&request)));
        assert!(!Table::default().is_recorded(&whole));
    }
}

#[test]
fn with_is_asked_for_the_component_to_which_a_mission_sends_each_message() {
    let (own, other) = (VEHICLE, JausId::new(102, 1, 1));
    let all = JausId::EVERYONE;
    let check = |messages: &[(JausId, &[u8])]| {
        check_octets("command with=101.255.255", &mission_to(messages))
    };
    assert_eq!(check(&[(own, WRENCH), (own, VELOCITY)]), Ok(()));
    let elsewhere = [(other, WRENCH), (other, VELOCITY), (other, STOP)];
    for message in elsewhere {
        assert_eq!(check(&[(own, WRENCH), message]), Err(Refusal::Elsewhere));
    }
    // A message to a group must stay within `with`, too; a query need not.
    assert_eq!(check(&[(all, WRENCH)]), Err(Refusal::TooWide));
    assert_eq!(check(&[(all, STOP)]), Err(Refusal::TooWide));
    assert_eq!(check(&[(all, VELOCITY)]), Ok(()));
    assert_eq!(check(&[(JausId::new(101, 255, 255), STOP)]), Ok(()));
    // Neither can a mission inside an element of a list reach others.
    let inner = element(&mission_to(&[(other, WRENCH)]));
    assert_eq!(
        check_octets("command with=101.255.255", &inner),
        Err(Refusal::Elsewhere)
    );
    // Insert Messages and Insert Mission Task name destinations as well.
    let to = other.to_wire();
    let insert = [
        &[0x06, 0x0E, 1, 0, 1, 0, 1, 0, 0, 1, 0, 2, 0][..],
        &to,
        b"\x04\0\0\0\x05\x04\0\0\0",
    ];
    let task = [
        &[0x08, 0x0E, 1, 0, 1, 0, 0, 1, 0, 2, 0, 1, 0, 3, 0][..],
        &to,
        b"\x04\0\0\0\x05\x04\0\0\0\0\0",
    ];
    for message in [insert.concat(), task.concat()] {
        assert_eq!(
            check_octets("command with=102.255.255,101.255.255", &message),
            Ok(())
        );
        assert_eq!(
            check_octets("command with=101.255.255", &message),
            Err(Refusal::Elsewhere)
        );
    }
}

#[test]
fn what_is_hidden_may_be_for_others_so_with_needs_to_see_it() {
    let whole = mission_to(&[(JausId::new(102, 1, 1), WRENCH)]);
    let all = Rules::everything().to_string();
    assert_eq!(check_octets(&all, &whole[..12]), Ok(()));
    let refused = check_octets(&format!("{all} with=101.255.255"), &whole[..12]);
    assert_eq!(refused, Err(Refusal::Hidden));
}

#[test]
fn only_lets_no_carrier_pass_that_does_something_by_itself() {
    let driver = "control=255 configure clear-emergency=any only=PrimitiveDriver";
    // What a user of `only=PrimitiveDriver` expects to work.
    for message in [
        WRENCH.to_vec(),
        command_event(WRENCH),
        command_event(VELOCITY),
        command_event(STOP),
        event(VELOCITY),
        STOP.to_vec(),
    ] {
        assert_eq!(check_octets(driver, &message), Ok(()), "{message:02X?}");
    }
    // Lists and missions are changed, whatever is in them.
    for inner in [WRENCH, VELOCITY, STOP] {
        for carrier in [element, mission] {
            assert_eq!(
                check_octets(driver, &carrier(inner)),
                Err(Refusal::Excluded),
                "{inner:02X?}"
            );
        }
    }
    // They may be listed, and what they carry is selected nevertheless.
    let listed = "command only=SetWrenchEffort,SetElement,SpoolMission";
    let speed = SetTravelSpeed::default().encode().unwrap();
    for carrier in [element, mission] {
        assert_eq!(check_octets(listed, &carrier(WRENCH)), Ok(()));
        assert_eq!(check_octets(listed, &carrier(VELOCITY)), Ok(()));
        assert_eq!(
            check_octets(listed, &carrier(&speed)),
            Err(Refusal::Excluded)
        );
    }
    // Control, emergencies and configuration pass plainly, but not inside of others unless listed.
    for message in [&b"\x0D\0\x05"[..], b"\x07\0\x01\0", b"\x02\0"] {
        assert_eq!(check_octets(driver, message), Ok(()));
        let carried = command_event(message);
        assert_eq!(check_octets(driver, &carried), Err(Refusal::Excluded));
    }
}
