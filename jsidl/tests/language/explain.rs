//! Explanations of messages: for any octets, each octet is in exactly one row, and the rows show
//! the content of the message.

use crate::support::catalogue;
use jaus_test_kit::evidence;
use jsidl::dynamic::{Limits, arbitrary, decode_with, encode};
use jsidl::explain::{Explanation, Kind, Row, Unexplained, explain, explain_as, table};
use jsidl::model::Message;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// Checks that the rows contain the octets once and in order.
#[track_caller]
fn covers(rows: &[Row], octets: &[u8]) {
    let mut position = 0;
    for row in rows.iter().filter(|row| !row.octets.is_empty()) {
        assert_eq!(row.offset, position, "{row:?}\n{}", table(rows));
        position += row.octets.len();
    }
    let told: Vec<u8> = rows.iter().flat_map(|row| row.octets.clone()).collect();
    assert_eq!(told, octets, "\n{}", table(rows));
}

/// The text of each row, without its octets.
fn said(explanation: &Explanation) -> Vec<String> {
    let said = |row: &Row| format!("{}: {} {}", row.label(), row.raw_text(), row.meaning());
    explanation.rows.iter().map(said).collect()
}

#[test]
fn every_octet_of_every_golden_message_is_explained_once_and_in_order() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut total = 0;
    for (source, rows) in crate::support::golden::sources() {
        let library = crate::support::golden::load(&corpus, &source);
        for row in &rows {
            let message = crate::support::golden::message_of(&library, row);
            let octets = crate::support::golden::octets_of(&row["hex"]);
            let (rows, stop) = explain_as(message, &octets);
            assert_eq!(stop, None, "{row}");
            covers(&rows, &octets);
            assert!(rows.iter().all(|row| row.kind != Kind::Unread));
            let explained = explain(&library, &octets, None).unwrap();
            covers(&explained.rows, &octets);
            total += 1;
        }
    }
    println!("{total} vectors");
    assert!(total > 2000, "the golden data have 2116 vectors");
}

#[test]
fn any_octets_are_explained_or_marked_as_not_read() {
    let library = catalogue();
    let messages: Vec<_> = library.services().flat_map(|s| s.messages()).collect();
    let hand_made = [
        crate::support::everything(),
        crate::support::framed(),
        crate::support::emptiness(),
    ];
    let config = ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let octets = prop::collection::vec(prop_oneof![0_u8..4, any::<u8>()], 0..120);
    let which = any::<prop::sample::Index>();
    TestRunner::new(config)
        .run(&(which, octets, any::<bool>()), |(which, octets, whole)| {
            let message: &Message = match which.index(messages.len() + hand_made.len()) {
                n if n < messages.len() => messages[n],
                n => &hand_made[n - messages.len()],
            };
            let octets = if whole {
                encode(message, &arbitrary(message, &octets)).unwrap()
            } else {
                [&message.code.to_le_bytes(), &octets[..]].concat()
            };
            let (rows, stop) = explain_as(message, &octets);
            covers(&rows, &octets);
            let plain = decode_with(message, &octets, Limits::Ignored);
            prop_assert_eq!(stop, plain.err());
            match explain(&library, &octets, None) {
                Ok(explained) => covers(&explained.rows, &octets),
                Err(error) => prop_assert!(!error.to_string().is_empty()),
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn rows_say_the_number_its_meaning_and_what_is_absent() {
    let message = crate::support::everything();
    let value = arbitrary(&message, &[]);
    let octets = encode(&message, &value).unwrap();
    let (rows, stop) = explain_as(&message, &octets);
    assert_eq!(stop, None);
    let text = table(&rows);
    let has = |part: &str| assert!(text.contains(part), "{part:?} is not in\n{text}");
    has("(message code)");
    has("Scaled.Speed");
    has("0 meter");
    has("Flags.Bits.Low");
    has("Off (bits 0 to 3)");
    has("absent: bit 1 of the presence vector is 0");
    has("Choice (tag)");
    has("More");
}

#[test]
fn a_message_within_a_message_is_taken_apart_as_well() {
    // The seventh message of event 3 reports the authority 128.
    let octets = [0xF1, 0x41, 3, 7, 3, 0, 0, 0, 0x01, 0x40, 128];
    let explained = explain(&catalogue(), &octets, None).unwrap();
    covers(&explained.rows, &octets);
    assert_eq!(
        said(&explained),
        [
            "(message code): 41F1h Event",
            "EventID: 3 3",
            "SequenceNumber: 7 7",
            "ReportMessage (count): 3 ",
            "ReportMessage (message code): 4001h ReportAuthority",
            "ReportMessage.AuthorityCode: 128 128",
        ]
    );
}

#[test]
fn reading_stops_at_the_mistake_and_the_rest_is_shown_as_not_read() {
    let library = catalogue();
    let explained = explain(&library, &[0x00, 0x2B, 0x02, 0xFF, 0xEE], None).unwrap();
    assert_eq!(
        said(&explained),
        [
            "(message code): 2B00h QueryIdentification",
            "QueryType: 2 Subsystem Identification",
            "(not read):  octets after the end of the message: 2",
        ]
    );
    let stop = explained.stop.unwrap();
    assert_eq!(stop.offset, 3);
    assert_eq!(explained.rows[2].octets, [0xFF, 0xEE]);
}

#[test]
fn what_cannot_be_looked_up_is_refused_with_advice() {
    let library = catalogue();
    let said = |octets: &[u8], service: Option<&str>| {
        let service = service.map(|name| name.parse().unwrap());
        explain(&library, octets, service.as_ref())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        said(&[7], None),
        "a message starts with the two octets of its code, but there are only 1"
    );
    assert_eq!(
        said(&[0xFE, 0xCA], None),
        "no loaded definition has the message code CAFEh; name the file that has it"
    );
    assert_eq!(
        said(&[0x00, 0x2B], Some("urn:jaus:jss:core:Discover")),
        "there is no service urn:jaus:jss:core:Discover; did you mean urn:jaus:jss:core:Discovery@1.1?"
    );
    assert_eq!(
        said(&[0x00, 0x2B], Some("Time 1.0")),
        "Time@1.0 has no message 2B00h; it is defined in urn:jaus:jss:core:Discovery@1.0, urn:jaus:jss:core:Discovery@1.1"
    );
    assert_eq!(
        "Time 1".parse::<jsidl::explain::ServiceName>(),
        Err(Unexplained::Version { text: "1".into() })
    );
}

#[test]
fn a_service_is_named_in_full_or_by_its_last_part() {
    let library = catalogue();
    for name in [
        "urn:jaus:jss:core:Discovery",
        "Discovery",
        "discovery 1.0",
        "urn:jaus:jss:core:Discovery@1.0",
    ] {
        let name = name.parse().unwrap();
        let explained = explain(&library, &[0x00, 0x2B, 0x02], Some(&name)).unwrap();
        assert!(name.matches(&explained.service), "{name}");
    }
    // Inherited messages belong to a service as well.
    let management = "Management".parse().unwrap();
    let explained = explain(&library, &[0x0D, 0x00, 0x80], Some(&management)).unwrap();
    assert_eq!(explained.message, "RequestControl");
}

#[test]
fn octets_are_a_message_however_the_definition_spells_their_format() {
    let kinds = |format: &str| {
        let mut loader = jsidl::Loader::new();
        loader.text(
            "t.xml",
            &format!(
                r#"<service_def name="S" id="urn:example:S" version="1.0" xmlns="urn:jaus:jsidl:1.1">
<description/><assumptions/><message_set><input_set/><output_set>
<message_def name="M" message_id="D001" is_command="false"><description/>
<header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>
<body name="Body"><record name="BodyRec" optional="false">
<variable_length_field name="Data" optional="false" field_format="{format}">
<count_field field_type_unsigned="unsigned byte"/></variable_length_field></record></body>
<footer name="Footer"/></message_def></output_set></message_set></service_def>"#
            ),
        );
        let loaded = loader.load();
        let explained = explain(&loaded.library, &[0x01, 0xD0, 2, 0x34, 0x12], None).unwrap();
        explained.rows.iter().any(|row| row.kind == Kind::Message)
    };
    assert!(kinds("JAUS MESSAGE"));
    assert!(kinds("JAUS Message"));
    assert!(!kinds("User Defined"));
}
