#![cfg(feature = "mobility")]

use std::collections::BTreeMap;

use bytes::Bytes;

use crate::codec::Message;
use crate::messages::core::{
    ClearEmergency, QueryIdentification, RequestControl, SetEmergency, Shutdown, Standby,
};
use crate::messages::mobility::{QueryVelocityState, SetTravelSpeed, SetWrenchEffort};
use crate::wire::{Flags, Version};

use super::*;

const VEHICLE: JausId = JausId::new(101, 1, 1);

fn frame(payload: impl Into<Bytes>) -> Frame {
    Frame::new(JausId::new(60, 1, 1), VEHICLE, payload.into())
}

fn check(rules: &str, message: &impl Message) -> Result<(), Refusal> {
    let payload = message.encode().unwrap();
    rules
        .parse::<Rules>()
        .unwrap()
        .check(&frame(payload), &Table::default())
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
    assert!(rules.check(&no_authority, &Table::default()).is_err());
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

/// What decides may be cut off, and follow in another fragment.
#[test]
fn a_fragment_without_what_decides_needs_the_greatest_right() {
    let fragment = |octets: &'static [u8]| Frame {
        flags: Flags::default().with_data(DataControl::First),
        ..frame(octets)
    };
    let check = |rules: &str, octets| {
        let rules = rules.parse::<Rules>().unwrap();
        rules.check(&fragment(octets), &Table::default())
    };
    for cut in [&b"\x07\x00"[..], b"\x07\x00\xFF"] {
        let refused = Err(Refusal::ClearAnyEmergency);
        assert_eq!(check("clear-emergency", cut), refused);
        assert_eq!(check("clear-emergency=any", cut), Ok(()));
    }
    assert_eq!(check("clear-emergency", b"\x07\x00\x01\x00"), Ok(()));
    for cut in [&b"\x0D\x00"[..], b"\x31\xFF", b"\x01\x00"] {
        assert!(check("control=254", cut).is_err());
        assert_eq!(check("control=255", cut), Ok(()));
    }
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
    let check = |rules: &str| {
        rules
            .parse::<Rules>()
            .unwrap()
            .check(&event, &Table::default())
    };
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
    let check = |rules: &str| {
        rules
            .parse::<Rules>()
            .unwrap()
            .check(&event, &Table::default())
    };
    assert_eq!(check(""), Ok(()));
    assert_eq!(check("except=QueryVelocityState"), Err(Refusal::Excluded));
}

#[test]
fn what_no_definition_states_needs_a_right_of_its_own() {
    let all = "command control=255 clear-emergency=any configure";
    for code in [0xDABCu16, 0xEABC, 0xFABC, 0x1ABC, 0x2ABC, 0x4ABC] {
        let frame = frame(code.to_le_bytes().to_vec());
        let check = |rules: &str| {
            rules
                .parse::<Rules>()
                .unwrap()
                .check(&frame, &Table::default())
        };
        assert_eq!(check("observe"), Err(Refusal::Unknown), "{code:04X}");
        assert_eq!(check(all), Err(Refusal::Unknown), "{code:04X}");
        assert_eq!(check(&format!("observe also={code:04X}h")), Ok(()));
        assert_eq!(check("observe also=any"), Ok(()));
        assert_eq!(Rules::everything().check(&frame, &Table::default()), Ok(()));
    }
    // It gives no right to messages whose definitions state what they need.
    assert_eq!(
        check("also=0405h", &SetWrenchEffort::default()),
        Err(Refusal::Command)
    );
    let nothing = frame(&b"\x05"[..]);
    assert_eq!(
        Rules::default().check(&nothing, &Table::default()),
        Err(Refusal::NoCode)
    );
}

/// The whole catalogue: what each message of it needs, and that no lesser right will do.
#[test]
fn every_message_of_the_catalogue_needs_the_right_that_its_definition_states() {
    let lines = include_str!(concat!(env!("OUT_DIR"), "/permissions.txt")).lines();
    let messages: Vec<_> = lines.filter(|it| !it.starts_with("service ")).collect();
    let table = Table::default();
    assert_eq!(
        table.codes().count(),
        messages.len(),
        "each line can be read"
    );
    let mut counts = BTreeMap::new();
    for line in messages {
        let words: Vec<_> = line.split(' ').collect();
        let code = u16::from_str_radix(words[0], 16).unwrap();
        let (right, place) = words[1].split_once('@').unwrap_or((words[1], ""));
        *counts.entry(right).or_insert(0) += 1;
        let mut message = code.to_le_bytes().to_vec();
        // Empty lists and requests, and the authority 9.
        message.extend([0; 64]);
        if let Ok(place) = place.parse::<usize>() {
            message[place] = 9;
        }
        let check = |rules: &str| {
            rules
                .parse::<Rules>()
                .unwrap()
                .check(&frame(message.clone()), &Table::default())
        };
        let (enough, lacking) = match right {
            "observe" | "answer" | "release" | "emergency" => (vec!["", "observe"], Vec::new()),
            "command" => (
                vec!["command", "control=0"],
                vec!["", "clear-emergency=any configure"],
            ),
            "clear-emergency" => (vec!["clear-emergency"], vec!["", "control=255 configure"]),
            "configure" => (
                vec!["configure"],
                vec!["", "control=255 clear-emergency=any"],
            ),
            "control" if place.is_empty() => (vec!["control=0"], vec!["", "command configure"]),
            "control" => (
                vec!["control=9"],
                vec!["", "control=8", "command configure"],
            ),
            other => panic!("{other}"),
        };
        for rules in enough {
            assert_eq!(check(rules), Ok(()), "{line}: {rules}");
        }
        for rules in lacking {
            assert!(check(rules).is_err(), "{line}: {rules}");
        }
    }
    assert!(
        counts["command"] > 100 && counts["observe"] > 300,
        "{counts:?}"
    );
    assert_eq!(counts["control"], 4, "{counts:?}");
}

#[test]
fn nothing_that_a_definition_calls_a_command_is_free_but_what_ends_or_stops() {
    let registry = crate::messages::registry();
    let commands = registry.iter().filter(|it| it.is_command);
    let free = commands.filter(|it| {
        let permission = Table::default().permission(&it.code.to_le_bytes());
        permission.is_none_or(Permission::is_free)
    });
    let mut free: Vec<_> = free.map(|it| it.name).collect();
    free.sort_unstable();
    free.dedup();
    let expected = [
        "CancelEvent",
        "CreateEvent",
        "RegisterServices",
        "ReleaseControl",
        "SetEmergency",
        "UpdateEvent",
    ];
    assert_eq!(free, expected);
}

#[test]
fn the_elements_of_a_list_and_the_messages_of_a_mission_are_asked_in_turn() {
    /// Set Element: request 1, one element: 1 between 0 and 0, a message of so many octets.
    fn element(message: &[u8]) -> Vec<u8> {
        let head = [0x1A, 0x04, 1, 1, 1, 0, 0, 0, 0, 0, 0];
        [&head[..], &(message.len() as u16).to_le_bytes(), message].concat()
    }
    /// Spool Mission: mission 1 of 60.1.1, one task 1 with a message 1 to 101.1.1.
    fn mission(message: &[u8]) -> Vec<u8> {
        let head = [
            0x00, 0x0E, 1, 0, 1, 1, 60, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 1, 101, 0,
        ];
        let length = (message.len() as u32).to_le_bytes();
        [&head[..], &length, message, &[0, 0, 0]].concat()
    }
    let request = request(255).encode().unwrap();
    let shutdown = Shutdown.encode().unwrap();
    let speed = SetTravelSpeed::default().encode().unwrap();
    for carrier in [element, mission] {
        let check = |rules: &str, message: &[u8]| {
            let frame = frame(carrier(message));
            rules
                .parse::<Rules>()
                .unwrap()
                .check(&frame, &Table::default())
        };
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
        assert_eq!(check("command only=SetTravelSpeed", &speed), Ok(()));
        assert_eq!(
            check("command only=PrimitiveDriver", &speed),
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
            assert!(
                "command"
                    .parse::<Rules>()
                    .unwrap()
                    .check(&cut, &Table::default())
                    .is_err(),
                "{end}"
            );
            assert_eq!(everything.check(&cut, &Table::default()), Ok(()), "{end}");
        }
        assert!(Table::default().is_recorded(&carrier(&request)));
        assert!(!Table::default().is_recorded(&whole));
    }
}

#[test]
fn definitions_of_ones_own_add_rows_and_lessen_no_right() {
    let lines = "D103 command SetLamp\n0405 observe Wrench\nD104 control@3 TakeLamp\n\
                 service urn:example:Lamp D103 D104";
    let table = Table::default().with(lines).unwrap();
    let check = |rules: &str, message: &[u8]| {
        let rules = rules.parse::<Rules>()?;
        Ok::<_, RuleError>(rules.check(&frame(message.to_vec()), &table))
    };
    assert_eq!(check("", b"\x03\xD1"), Ok(Err(Refusal::Command)));
    assert_eq!(check("command only=D103h", b"\x03\xD1"), Ok(Ok(())));
    assert_eq!(
        check("command only=D103h", b"\x05\x04\0\0"),
        Ok(Err(Refusal::Excluded))
    );
    assert_eq!(check("", b"\x05\x04\0\0"), Ok(Err(Refusal::Command)));
    let refused = Refusal::Authority {
        asked: 200,
        most: 99,
    };
    assert_eq!(check("control=99", b"\x04\xD1\0\xC8"), Ok(Err(refused)));
    assert!(
        "only=Lamp".parse::<Rules>().is_err(),
        "the catalogue has no lamp"
    );
    for line in [
        "D103",
        "D103 command",
        "D103 drive SetLamp",
        "X command SetLamp",
        "D103 command SetLamp 4m4",
    ] {
        let error = Table::default().with(line).unwrap_err().to_string();
        assert!(error.contains(line), "{error}");
    }
}

#[test]
fn a_request_for_a_handoff_is_a_request_for_control() {
    let handoff = |authority: u8| frame(vec![0x31, 0xFF, authority, 0]);
    let check = |rules: &str, authority| {
        rules
            .parse::<Rules>()
            .unwrap()
            .check(&handoff(authority), &Table::default())
    };
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
    assert!(is_recorded(&handoff(1), &Table::default()));
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
            .check(
                &fragment(DataControl::First, b"\x05\x04\0"),
                &Table::default()
            )
            .is_err()
    );
    assert!(
        rules
            .check(
                &fragment(DataControl::Middle, b"\x05\x04\0"),
                &Table::default()
            )
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
    assert_eq!(
        rules.check(&elsewhere, &Table::default()),
        Err(Refusal::Elsewhere)
    );
}

#[test]
fn a_command_to_several_ids_needs_all_of_them_and_a_query_one() {
    let rules: Rules = "command with=101.1.40,102.255.255".parse().unwrap();
    let to = |id: &str, payload: &'static [u8]| Frame {
        destination: id.parse().unwrap(),
        ..frame(payload)
    };
    let wrench = b"\x05\x04\0";
    assert_eq!(
        rules.check(&to("101.1.40", wrench), &Table::default()),
        Ok(())
    );
    assert_eq!(
        rules.check(&to("102.255.255", wrench), &Table::default()),
        Ok(())
    );
    for id in ["101.255.255", "65535.255.255", "101.1.255"] {
        assert_eq!(
            rules.check(&to(id, wrench), &Table::default()),
            Err(Refusal::TooWide),
            "{id}"
        );
        assert_eq!(
            rules.check(&to(id, b"\x00\x2B\x02"), &Table::default()),
            Ok(()),
            "{id}"
        );
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
        rules.check(&event(DataControl::First, 11), &Table::default()),
        Err(Refusal::Hidden)
    );
    assert_eq!(
        rules.check(&event(DataControl::First, 12), &Table::default()),
        Err(Refusal::Hidden)
    );
    assert_eq!(
        rules.check(&event(DataControl::First, 14), &Table::default()),
        Err(Refusal::Hidden)
    );
    assert_eq!(
        rules.check(&event(DataControl::First, 15), &Table::default()),
        Ok(())
    );
    assert_eq!(
        rules.check(&event(DataControl::Single, 15), &Table::default()),
        Ok(())
    );
    assert_eq!(
        rules.check(&event(DataControl::Single, 14), &Table::default()),
        Err(Refusal::Hidden)
    );
}

#[test]
fn fragments_that_repeat_the_code_are_checked_each() {
    let rules = Rules::default();
    let later = |version| Frame {
        version,
        flags: Flags::default().with_data(DataControl::Last),
        ..frame(&b"\x05\x04\0"[..])
    };
    assert_eq!(
        rules.check(&later(Version::As5669a), &Table::default()),
        Ok(())
    );
    assert_eq!(
        rules.check(&later(Version::As5669), &Table::default()),
        Err(Refusal::Command)
    );
}

#[test]
fn an_answer_with_the_code_of_a_command_needs_no_right() {
    for code in [0x000Fu16, 0x0010, 0x01F3, 0x01F4, 0x041C, 0x041D] {
        let frame = frame(code.to_le_bytes().to_vec());
        assert_eq!(
            Rules::default().check(&frame, &Table::default()),
            Ok(()),
            "{code:04X}"
        );
    }
    // Execute List and its like are commands, whatever their definitions say.
    for code in [0x061Eu16, 0x080B, 0x080C] {
        let frame = frame(code.to_le_bytes().to_vec());
        assert_eq!(
            Rules::default().check(&frame, &Table::default()),
            Err(Refusal::Command),
            "{code:04X}"
        );
    }
}

#[test]
fn rules_are_written_as_they_are_read() {
    let text = "command clear-emergency configure control=127 with=101.255.255 \
                only=PrimitiveDriver,D103h except=Time also=D103h";
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
