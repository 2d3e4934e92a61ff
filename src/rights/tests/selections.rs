//! `only`, `except` and `also`: names and codes.

use super::*;

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

/// A table with a lamp of one's own.
fn with_lamp() -> Table {
    let lines = "D103 command SetLamp\nD104 command DimLamp\nservice urn:example:Lamp D103 D104";
    Table::default().with(lines).unwrap()
}

#[test]
fn names_of_further_definitions_mean_what_the_table_in_use_says() {
    let table = with_lamp();
    let check = |rules: &str, message: &[u8], table: &Table| {
        let rules: Rules = rules.parse().unwrap();
        rules.check(&frame(message.to_vec()), table)
    };
    let (set, dim) = (b"\x03\xD1", b"\x04\xD1");
    for name in ["SetLamp", "D103h"] {
        let only = format!("command only={name}");
        assert_eq!(check(&only, set, &table), Ok(()));
        assert_eq!(check(&only, dim, &table), Err(Refusal::Excluded));
    }
    for name in ["Lamp", "urn:example:Lamp"] {
        let only = format!("command only={name}");
        assert_eq!(check(&only, dim, &table), Ok(()));
        assert_eq!(
            check(&only, b"\x05\x04\0\0", &table),
            Err(Refusal::Excluded)
        );
        let except = format!("command except={name}");
        assert_eq!(check(&except, dim, &table), Err(Refusal::Excluded));
        assert_eq!(check(&except, b"\x05\x04\0\0", &table), Ok(()));
    }
}

#[test]
fn a_name_that_no_definition_has_gives_no_right_and_takes_none_silently() {
    let refused = |rules: &str, message: &[u8]| {
        let rules: Rules = rules.parse().unwrap();
        let error = rules.verify(&Table::default()).unwrap_err().to_string();
        assert!(error.contains("is not a service, a message"), "{error}");
        rules.check(&frame(message.to_vec()), &Table::default())
    };
    let wrench = b"\x05\x04\0\0";
    assert_eq!(
        refused("command only=SetLamp", wrench),
        Err(Refusal::Excluded)
    );
    assert_eq!(
        refused("command except=SetLamp", wrench),
        Err(Refusal::UnknownName)
    );
    let stop = b"\x06\0\x01\0";
    assert_eq!(refused("except=SetLamp", stop), Ok(()), "a stop passes");
    assert_eq!(refused("also=SetLamp", b"\x03\xD1"), Err(Refusal::Unknown));
    let rules: Rules = "command only=SetLamp".parse().unwrap();
    assert_eq!(rules.verify(&with_lamp()), Ok(()));
}

#[test]
fn also_for_a_message_with_a_definition_is_an_error_that_says_what_to_write() {
    let error = |rules: &str, table: &Table| {
        let rules: Rules = rules.parse().unwrap();
        rules.verify(table).map_err(|it| it.to_string())
    };
    let found = error("also=0405h", &Table::default()).unwrap_err();
    assert!(
        found.contains("SetWrenchEffort") && found.contains("write `command`"),
        "{found}"
    );
    assert_eq!(error("also=D103h", &Table::default()), Ok(()));
    assert!(error("also=D103h", &with_lamp()).is_err());
    assert_eq!(error("also=any", &with_lamp()), Ok(()));
}
