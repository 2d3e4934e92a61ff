use bytes::Bytes;
use jaus::codec::Message;
use jaus::component::CLEAR_ALL;
use jaus::messages::core::{
    ClearEmergency, QueryIdentification, RequestControl, SetEmergency, Shutdown, Standby,
};
use jaus::messages::mobility::{QueryVelocityState, SetTravelSpeed, SetWrenchEffort};
use jaus::wire::{Flags, Version};

use super::*;

const VEHICLE: JausId = JausId::new(101, 1, 1);

fn frame(payload: impl Into<Bytes>) -> Frame {
    Frame::new(JausId::new(60, 1, 1), VEHICLE, payload.into())
}

fn check(rules: &str, message: &impl Message) -> Result<(), Refusal> {
    let payload = message.encode().unwrap();
    rules.parse::<Rules>().unwrap().check(&frame(payload))
}

fn request(authority_code: u8) -> RequestControl {
    RequestControl { authority_code }
}

#[test]
fn a_key_without_rules_observes_and_may_stop() {
    assert_eq!(check("", &QueryVelocityState::default()), Ok(()));
    assert_eq!(check("", &QueryIdentification::default()), Ok(()));
    assert_eq!(check("", &SetEmergency::default()), Ok(()));
    assert_eq!(
        check("observe", &SetWrenchEffort::default()),
        Err(Refusal::Command)
    );
    assert_eq!(check("", &Standby), Err(Refusal::Command));
    assert_eq!(check("", &request(0)), Err(Refusal::Control));
    assert_eq!(check("", &Shutdown), Err(Refusal::Configure));
    assert_eq!(
        check("", &ClearEmergency::default()),
        Err(Refusal::ClearEmergency)
    );
}

#[test]
fn a_key_stops_unless_its_line_excepts_it_and_clients_that_nobody_named_do_not() {
    let stop = SetEmergency::default();
    assert_eq!(check("observe", &stop), Ok(()));
    assert_eq!(check("only=PrimitiveDriver", &stop), Ok(()));
    assert_eq!(check("except=SetEmergency", &stop), Err(Refusal::Excluded));
    assert_eq!(Rules::watch(), "except=SetEmergency".parse().unwrap());
}

#[test]
fn control_is_limited_by_authority() {
    let refused = Refusal::Authority {
        asked: 128,
        most: 127,
    };
    assert_eq!(check("control=127", &request(127)), Ok(()));
    assert_eq!(check("control=127", &request(128)), Err(refused));
    assert_eq!(check("control=127", &SetWrenchEffort::default()), Ok(()));
    assert_eq!(check("command", &request(1)), Err(Refusal::Control));
    let no_authority = frame(&b"\x0D\x00"[..]);
    let rules: Rules = "control=127".parse().unwrap();
    assert!(rules.check(&no_authority).is_err());
}

#[test]
fn each_further_right_has_its_word() {
    assert_eq!(check("clear-emergency", &ClearEmergency::default()), Ok(()));
    let all = ClearEmergency {
        emergency_code: CLEAR_ALL.into(),
    };
    assert_eq!(check("clear-emergency=any", &all), Ok(()));
    assert_eq!(
        check("clear-emergency=any", &ClearEmergency::default()),
        Ok(())
    );
    for rules in ["", "control=255 configure", "clear-emergency"] {
        assert!(check(rules, &all).is_err(), "{rules}");
    }
    assert_eq!(
        check("clear-emergency", &all),
        Err(Refusal::ClearAnyEmergency)
    );
    assert_eq!(check("configure", &Shutdown), Ok(()));
    assert_eq!(
        check("configure", &SetWrenchEffort::default()),
        Err(Refusal::Command)
    );
}

#[test]
fn only_and_except_select_by_service_message_and_code() {
    let wrench = SetWrenchEffort::default();
    let speed = SetTravelSpeed::default();
    for rules in [
        "command only=PrimitiveDriver",
        "command only=SetWrenchEffort",
        "command only=0405h",
    ] {
        assert_eq!(check(rules, &wrench), Ok(()), "{rules}");
        assert_eq!(check(rules, &speed), Err(Refusal::Excluded), "{rules}");
        assert_eq!(
            check(rules, &QueryVelocityState::default()),
            Ok(()),
            "{rules}"
        );
    }
    assert_eq!(
        check("command except=SetTravelSpeed", &speed),
        Err(Refusal::Excluded)
    );
    assert_eq!(check("command except=SetTravelSpeed", &wrench), Ok(()));
    let query = QueryVelocityState::default();
    assert_eq!(
        check("except=VelocityStateSensor", &query),
        Err(Refusal::Excluded)
    );
}

#[test]
fn a_command_inside_an_event_needs_the_same_rights() {
    // Create Command Event: request 1, 10 s, a Set Wrench Effort of 3 octets.
    let event = frame(&b"\xF6\x01\x01\x0A\0\0\0\x04\0\0\0\x05\x04\0\0"[..]);
    let check = |rules: &str| rules.parse::<Rules>().unwrap().check(&event);
    assert_eq!(check(""), Err(Refusal::Command));
    assert_eq!(check("command"), Ok(()));
    assert_eq!(check("command only=SetWrenchEffort"), Ok(()));
    assert_eq!(check("command only=SetTravelSpeed"), Err(Refusal::Excluded));
    assert_eq!(
        check("command except=SetWrenchEffort"),
        Err(Refusal::Excluded)
    );
    // Create Event: request 1, periodic, a Query Velocity State.
    let event = frame(&b"\xF0\x01\x01\0\0\x01\x04\0\0\0\x04\x24\0\0"[..]);
    let check = |rules: &str| rules.parse::<Rules>().unwrap().check(&event);
    assert_eq!(check(""), Ok(()));
    assert_eq!(check("except=QueryVelocityState"), Err(Refusal::Excluded));
}

#[test]
fn what_no_definition_has_needs_the_right_to_command() {
    let (observer, commander) = (Rules::default(), "command".parse::<Rules>().unwrap());
    for code in [0xDABCu16, 0xEABC, 0xFABC, 0x1ABC, 0x2ABC, 0x4ABC] {
        let frame = frame(code.to_le_bytes().to_vec());
        assert_eq!(observer.check(&frame), Err(Refusal::Command), "{code:04X}");
        assert_eq!(commander.check(&frame), Ok(()), "{code:04X}");
    }
    assert_eq!(observer.check(&frame(&b"\x05"[..])), Err(Refusal::NoCode));
}

#[test]
fn no_key_that_observes_sends_what_a_definition_calls_a_command() {
    // Each ends what its sender has, or stops.
    const HARMLESS: [&str; 7] = [
        "ReleaseControl",
        "SetEmergency",
        "RegisterServices",
        "CreateEvent",
        "UpdateEvent",
        "CancelEvent",
        "ConfirmControl",
    ];
    let rules = Rules::default();
    let mut commands = 0;
    for (code, name, is_command) in known::messages() {
        let mut message = code.to_le_bytes().to_vec();
        message.extend([0; 64]);
        if is_command && !HARMLESS.contains(&name) {
            commands += 1;
            assert!(rules.check(&frame(message)).is_err(), "{code:04X} {name}");
        } else if name.starts_with("Query") && known::is_command(code) == Some(false) {
            assert_eq!(rules.check(&frame(message)), Ok(()), "{code:04X} {name}");
        }
    }
    assert!(commands > 100, "{commands} commands");
}

#[test]
fn a_request_for_a_handoff_is_a_request_for_control() {
    let handoff = |authority: u8| {
        let [low, high] = permission::REQUEST_HANDOFF.to_le_bytes();
        frame(vec![low, high, authority, 0])
    };
    let check = |rules: &str, authority| rules.parse::<Rules>().unwrap().check(&handoff(authority));
    assert_eq!(check("observe", 255), Err(Refusal::Control));
    assert_eq!(check("command", 1), Err(Refusal::Control));
    assert_eq!(check("control=10", 10), Ok(()));
    let refused = Refusal::Authority {
        asked: 255,
        most: 10,
    };
    assert_eq!(check("control=10", 255), Err(refused));
    assert_eq!(
        check("control=10 except=RequestHandoff", 10),
        Err(Refusal::Excluded)
    );
    assert!(is_recorded(&handoff(1)));
}

#[test]
fn the_first_fragment_decides_on_a_large_message() {
    let rules = Rules::default();
    let fragment = |data, payload: &'static [u8]| Frame {
        flags: Flags::default().with_data(data),
        ..frame(payload)
    };
    assert!(
        rules
            .check(&fragment(DataControl::First, b"\x05\x04\0"))
            .is_err()
    );
    assert!(
        rules
            .check(&fragment(DataControl::Middle, b"\x05\x04\0"))
            .is_ok()
    );
}

#[test]
fn with_limits_the_ids_also_where_both_sides_have_wildcards() {
    let rules: Rules = "with=101.255.255,102.1.255".parse().unwrap();
    for (id, reached) in [
        ("101.1.1", true),
        ("102.1.9", true),
        ("102.2.9", false),
        ("103.1.1", false),
        ("65535.255.255", true),
        ("65535.1.255", true),
        ("103.255.255", false),
    ] {
        assert_eq!(rules.may_reach(id.parse().unwrap()), reached, "{id}");
    }
    let elsewhere = Frame {
        destination: JausId::new(103, 1, 1),
        ..frame(&b"\x00\x2B\x02"[..])
    };
    assert_eq!(rules.check(&elsewhere), Err(Refusal::Elsewhere));
}

#[test]
fn a_command_to_several_ids_needs_all_of_them_and_a_query_one() {
    let rules: Rules = "command with=101.1.40,102.255.255".parse().unwrap();
    let to = |id: &str, payload: &'static [u8]| Frame {
        destination: id.parse().unwrap(),
        ..frame(payload)
    };
    let wrench = b"\x05\x04\0";
    assert_eq!(rules.check(&to("101.1.40", wrench)), Ok(()));
    assert_eq!(rules.check(&to("102.255.255", wrench)), Ok(()));
    for id in ["101.255.255", "65535.255.255", "101.1.255"] {
        assert_eq!(rules.check(&to(id, wrench)), Err(Refusal::TooWide), "{id}");
        assert_eq!(rules.check(&to(id, b"\x00\x2B\x02")), Ok(()), "{id}");
    }
}

#[test]
fn a_carried_message_cannot_hide_behind_the_first_fragment() {
    let rules = Rules {
        command: true,
        ..Rules::default()
    };
    let event = |data, octets: usize| Frame {
        flags: Flags::default().with_data(data),
        ..frame(&b"\xF6\x01\x01\x0A\0\0\0\x04\0\0\0\x05\x04\0\0"[..octets])
    };
    assert_eq!(
        rules.check(&event(DataControl::First, 11)),
        Err(Refusal::Hidden)
    );
    assert_eq!(
        rules.check(&event(DataControl::First, 12)),
        Err(Refusal::Hidden)
    );
    assert_eq!(rules.check(&event(DataControl::First, 13)), Ok(()));
    assert_eq!(rules.check(&event(DataControl::Single, 15)), Ok(()));
}

#[test]
fn fragments_that_repeat_the_code_are_checked_each() {
    let rules = Rules::default();
    let later = |version| Frame {
        version,
        flags: Flags::default().with_data(DataControl::Last),
        ..frame(&b"\x05\x04\0"[..])
    };
    assert_eq!(rules.check(&later(Version::As5669a)), Ok(()));
    assert_eq!(rules.check(&later(Version::As5669)), Err(Refusal::Command));
}

#[test]
fn an_answer_with_the_code_of_a_command_needs_no_right() {
    for code in [0x000Fu16, 0x0010, 0x01F3, 0x01F4, 0x041C, 0x041D] {
        let frame = frame(code.to_le_bytes().to_vec());
        assert_eq!(Rules::default().check(&frame), Ok(()), "{code:04X}");
    }
    // Execute List and its like are commands, whatever their definitions say.
    for code in [0x061Eu16, 0x080B, 0x080C] {
        let frame = frame(code.to_le_bytes().to_vec());
        assert_eq!(
            Rules::default().check(&frame),
            Err(Refusal::Command),
            "{code:04X}"
        );
    }
}

#[test]
fn rules_are_written_as_they_are_read() {
    let text = "command clear-emergency configure control=127 with=101.255.255 \
                only=PrimitiveDriver,D103h except=Time";
    let rules: Rules = text.parse().unwrap();
    assert_eq!(rules.to_string(), text);
    assert_eq!(rules.to_string().parse::<Rules>().unwrap(), rules);
    assert_eq!(Rules::default().to_string(), "");
}

#[test]
fn a_wrong_word_is_named_with_what_to_write() {
    for (text, words) in [
        ("drive", "`drive` is not a rule: write observe"),
        ("control", "`control` is not a rule"),
        ("control=256", "`256` is not an authority"),
        ("with=101", "`101` is not an id"),
        ("only=PrimitiveDrive", "`PrimitiveDrive` is not a service"),
        ("only=", "`only=` has no entries"),
        ("command=1", "`command=1` is not a rule"),
    ] {
        let error = text.parse::<Rules>().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
