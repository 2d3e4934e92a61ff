//! What is decided on the first fragment of a large message.

use super::*;

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
