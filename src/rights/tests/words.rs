//! The words of rules, and what each of them allows.

use super::*;

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
        ("only=Primitive/Drive", "`Primitive/Drive` is not a service"),
        ("only=0405", "`0405` is not a service"),
        ("only=", "`only=` has no entries"),
        ("command=1", "`command=1` is not a rule"),
    ] {
        let error = text.parse::<Rules>().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
