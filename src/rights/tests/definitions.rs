//! What messages need: the catalogue, and definitions of one's own.

use super::*;

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

/// That the rights of the table are enforced; `jsidl/tests/language/permissions.rs` says which they are.
#[test]
fn no_message_of_the_catalogue_passes_without_each_right_that_its_line_has() {
    let lines = include_str!(concat!(env!("OUT_DIR"), "/permissions.txt")).lines();
    let messages: Vec<_> = lines.filter(|it| !it.starts_with("service ")).collect();
    let table = Table::default();
    assert_eq!(
        table.codes().count(),
        messages.len(),
        "each line can be read"
    );
    let words = [
        ("command", "command"),
        ("carry", "command"),
        ("clear-emergency", "clear-emergency"),
        ("configure", "configure"),
        ("control", "control=9"),
    ];
    for line in messages {
        let parts: Vec<_> = line.split(' ').collect();
        let code = u16::from_str_radix(parts[0], 16).unwrap();
        // Empty lists and requests, and the authority 9.
        let mut message = [&code.to_le_bytes()[..], &[0; 64]].concat();
        let mut needed = Vec::new();
        for need in parts[1].split(',') {
            let (right, place) = need.split_once('@').unwrap_or((need, ""));
            if let Ok(place) = place.parse::<usize>() {
                message[place] = 9;
            }
            needed.extend(
                words
                    .iter()
                    .filter(|(it, _)| *it == right)
                    .map(|(_, word)| *word),
            );
        }
        assert_eq!(check_octets(&needed.join(" "), &message), Ok(()), "{line}");
        for lacking in &needed {
            let mut rest: Vec<_> = words.iter().map(|(_, word)| *word).collect();
            rest.retain(|it| it != lacking && (*lacking != "command" || *it != "control=9"));
            let refused = check_octets(&rest.join(" "), &message);
            assert!(refused.is_err(), "{line} without {lacking}");
        }
    }
}

#[test]
fn a_code_of_two_messages_needs_the_rights_of_both() {
    let lines = "D103 configure,control@2 SetLamp,TakeLamp\nD103 clear-emergency ClearLamp";
    let table = Table::default().with(lines).unwrap();
    let check = |rules: &str| {
        let rules: Rules = rules.parse().unwrap();
        rules.check(&frame(b"\x03\xD1\x07\0".to_vec()), &table)
    };
    assert_eq!(check("configure control=7 clear-emergency"), Ok(()));
    assert_eq!(
        check("control=255 clear-emergency"),
        Err(Refusal::Configure)
    );
    assert_eq!(check("configure clear-emergency"), Err(Refusal::Control));
    assert_eq!(check("configure control=7"), Err(Refusal::ClearEmergency));
    assert_eq!(
        table.words(b"\x03\xD1\x07\0"),
        "configure control clear-emergency"
    );
    // A query of one service has the code of a command of another.
    assert_eq!(check_octets("", b"\x2A\xF9\0\0"), Err(Refusal::Command));
    assert_eq!(check_octets("command", b"\x2A\xF9\0\0"), Ok(()));
}

#[test]
fn nothing_that_a_definition_calls_a_command_is_free_but_what_ends_or_stops() {
    let registry = crate::messages::registry();
    let commands = registry.iter().filter(|it| it.is_command);
    let free = commands.filter(|it| {
        let code = it.code.to_le_bytes();
        Table::default()
            .needs(&code)
            .all(Permission::needs_no_right)
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
    // Of a set that is optional here: it withdraws a request of the sender's own.
    free.retain(|it| *it != "RemoveHandoffRequest");
    assert_eq!(free, expected);
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
fn a_message_stops_only_if_all_that_its_code_may_mean_and_all_that_it_carries_stops() {
    let table = Table::default();
    let standby = b"\x03\0";
    for message in [&standby[..], b"\x06\0\x01\0", b"\x0E\0", b"\x12\xD1"] {
        assert!(table.stops(message), "{message:x?}");
    }
    // Resume, Shutdown, an event that carries Standby, an unknown code, and no code.
    let event = [&b"\xF6\x01\x01\x0A\0\0\0\x02\0\0\0"[..], standby].concat();
    for message in [&b"\x04\0"[..], b"\x02\0", &event, b"\xBC\xDA", b"\x03"] {
        assert!(!table.stops(message), "{message:x?}");
    }
    let other = table.with("0003 command StartEngine").unwrap();
    assert!(!other.stops(standby), "the code may mean another message");
    // Who carries nothing but stops, stops.
    let lines = "D105 carry PassOn stops [m2]\n0003 command Idle stops";
    let own = table.with(lines).unwrap();
    assert!(own.stops(standby));
    let pass_on = |message: &[u8]| {
        let length = (message.len() as u16).to_le_bytes();
        own.stops(&[&b"\x05\xD1"[..], &length, message].concat())
    };
    assert!(pass_on(standby));
    assert!(!pass_on(b"\x04\0"));
    assert!(!own.stops(b"\x05\xD1\xFF\xFF\x03\0"), "malformed");
}
