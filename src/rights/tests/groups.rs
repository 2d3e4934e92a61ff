//! `with`: single ids, groups, and what ends or stops.

use super::*;

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

const STOP: &[u8] = b"\x06\0\x01\0";
const RELEASE: &[u8] = b"\x0E\0";
const STANDBY: &[u8] = b"\x03\0";

#[test]
fn what_ends_or_stops_reaches_those_of_a_group_that_its_sender_may_reach_and_no_others() {
    let rules = "command with=101.1.255,102.255.255,102.1.1";
    let rules: Rules = rules.parse().unwrap();
    let admitted = |to: &str, message: &'static [u8]| {
        let frame = Frame {
            destination: to.parse().unwrap(),
            ..frame(message)
        };
        let copies = rules.admit(&frame, &Table::default())?.copies(&frame);
        let ids = copies.map(|copies| {
            assert!(copies.iter().all(|it| it.payload == frame.payload));
            let ids = copies.iter().map(|it| it.destination.to_string());
            ids.collect::<Vec<_>>().join(" ")
        });
        Ok::<_, Refusal>(ids)
    };
    let narrowed = |ids: &str| Ok(Some(ids.to_owned()));
    for message in [STOP, RELEASE, STANDBY] {
        for inside in ["101.1.1", "101.1.255", "102.7.255"] {
            assert_eq!(admitted(inside, message), Ok(None), "{inside}");
        }
        assert_eq!(
            admitted("65535.255.255", message),
            narrowed("101.1.255 102.255.255")
        );
        assert_eq!(admitted("101.255.255", message), narrowed("101.1.255"));
        assert_eq!(admitted("101.255.33", message), narrowed("101.1.33"));
        assert_eq!(admitted("103.255.255", message), Err(Refusal::Elsewhere));
    }
    // A query may go to all: it does nothing.
    assert_eq!(admitted("65535.255.255", b"\x00\x2B\x02"), Ok(None));
    // A stop that is a command needs the right to it, and cannot be narrowed inside of another message.
    let all = JausId::EVERYONE;
    assert_eq!(
        check_to("with=101.1.255", all, STANDBY),
        Err(Refusal::Command)
    );
    let event = [&b"\xF6\x01\x01\x0A\0\0\0\x02\0\0\0"[..], STANDBY].concat();
    assert_eq!(
        check_to("command with=101.1.255", all, &event),
        Err(Refusal::TooWide)
    );
    // Who cannot narrow it must not let it pass.
    assert_eq!(
        check_to("with=101.1.255", JausId::EVERYONE, STOP),
        Err(Refusal::TooWide)
    );
    let part = Frame {
        flags: Flags::default().with_data(DataControl::First),
        destination: JausId::EVERYONE,
        ..frame(STOP)
    };
    assert_eq!(rules.admit(&part, &Table::default()), Err(Refusal::TooWide));
}
