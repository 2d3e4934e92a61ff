//! `jaus decode --hex` and `jaus encode` invert each other, and report faulty lines.

use crate::support::{run, vectors};
use jaus_test_kit::evidence;
use serde_json::json;

/// Decodes and encodes again. Returns the number of lines.
#[track_caller]
fn assert_identity(vectors: &str, definitions: &[&str]) -> usize {
    let decoded = run(
        &[&["decode", "--hex"], definitions].concat(),
        vectors.as_bytes(),
    );
    let failed: Vec<_> = decoded
        .stdout
        .lines()
        .filter(|line| !line.contains("\"body\""))
        .collect();
    assert!(
        failed.is_empty() && decoded.status == 0,
        "{failed:#?}{}",
        decoded.stderr
    );
    let encoded = run(
        &[&["encode"], definitions].concat(),
        decoded.stdout.as_bytes(),
    );
    for ((before, after), json) in vectors
        .lines()
        .zip(encoded.stdout.lines())
        .zip(decoded.stdout.lines())
    {
        assert_eq!(before, after, "{json}");
    }
    assert_eq!(encoded.stdout.lines().count(), vectors.lines().count());
    assert_eq!(encoded.status, 0);
    vectors.lines().count()
}

#[test]
fn every_golden_vector_of_core_and_mobility_comes_back_as_it_was() {
    let mut count = 0;
    for file in [
        "jts-core-v1.0",
        "jts-core-v1.1",
        "jts-mobility",
        "fkie-core-v1.0",
        "fkie-core-v1.1",
        "fkie-mobility",
    ] {
        let file = evidence::golden().join(format!("{file}.jsonl"));
        count += assert_identity(&vectors(&file), &[]);
    }
    assert!(count > 400, "{count} vectors");
}

#[test]
fn golden_vectors_of_other_services_come_back_with_their_definitions_at_hand() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for (file, definitions) in [("jts-ugv", "jts"), ("jts-environmentSensing", "jts")] {
        let definitions = corpus.join(definitions);
        let file = evidence::golden().join(format!("{file}.jsonl"));
        assert_identity(&vectors(&file), &["--jsidl", definitions.to_str().unwrap()]);
    }
}

#[test]
fn a_line_of_hex_becomes_a_line_of_json_without_transport_keys() {
    let run = run(&["decode", "--hex"], b"00 2B 02\n\n002b03\n");
    assert_eq!(
        run.stdout.lines().next().unwrap(),
        concat!(
            r#"{"code":"2B00","message":"QueryIdentification","#,
            r#""service":"urn:jaus:jss:core:Discovery","body":{"QueryType":"Subsystem Identification"}}"#
        )
    );
    assert_eq!((run.json().len(), run.status), (2, 0));
}

#[test]
fn a_line_of_hex_that_cannot_be_read_gives_an_error_on_its_line() {
    let run = run(
        &["decode", "--hex"],
        b"002b02\nxyz\n00\n002b\n01d0\n002b0200\n002b02\n",
    );
    let lines = run.json();
    let offsets: Vec<_> = lines.iter().map(|line| line["offset"].as_u64()).collect();
    assert_eq!(
        offsets,
        [None, Some(0), Some(0), Some(2), Some(0), Some(3), None]
    );
    assert_eq!(lines[3]["message"], "QueryIdentification");
    assert_eq!(lines[4]["code"], "D001");
    assert_eq!(run.status, 1);
}

#[test]
fn a_message_is_encoded_by_name_or_by_code() {
    let lines = [
        json!({"message": "QueryIdentification", "body": {"QueryType": 2}}),
        json!({"code": "2B00", "body": {"QueryType": 2}}),
        json!({"code": 0x2B00, "message": "QueryIdentification", "body": {"QueryType": "Subsystem Identification"}}),
        json!({"message": "QueryHeartbeatPulse"}),
    ];
    let input: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let run = run(&["encode"], input.as_bytes());
    assert_eq!(run.stdout, "002b02\n002b02\n002b02\n0222\n");
    assert_eq!((run.status, &*run.stderr), (0, ""));
}

#[test]
fn a_service_chooses_between_messages_with_one_name() {
    let line = b"{\"message\":\"ReportDigitalResourceEndpoint\",\"body\":[]}\n";
    let service = "urn:jaus:jss:iop:DigitalResourceDiscovery@1.1";
    let chosen = run(&["encode", "--service", service], line);
    assert_eq!(
        (&*chosen.stdout, chosen.status),
        ("02f700\n", 0),
        "{chosen:?}"
    );
    let unclear = run(&["encode"], line);
    assert!(unclear.stdout.contains("--service URN"), "{unclear:?}");
    assert_eq!(unclear.status, 1);
}

#[test]
fn enumerated_values_are_printed_by_name_and_read_by_name_and_number() {
    let standby = run(&["decode", "--hex"], b"02400200000000\n");
    assert_eq!(standby.only_line()["body"]["Status"], "STANDBY");
    let unnamed = run(&["decode", "--hex"], b"02407700000000\n");
    assert_eq!(unnamed.only_line()["body"]["Status"], 0x77);
    for status in [json!("STANDBY"), json!(2)] {
        let body = json!({"Status": status, "Reserved": 0});
        let line = json!({"message": "ReportStatus", "body": body}).to_string();
        let encoded = run(&["encode"], line.as_bytes());
        assert_eq!(encoded.stdout, "02400200000000\n", "{line}");
    }
}

#[test]
fn a_json_line_that_cannot_be_written_gives_an_error_that_helps() {
    for (line, help) in [
        (
            "{\"message\":\"QueryIdentifikation\"}",
            "there is no message QueryIdentifikation",
        ),
        (
            "{\"message\":\"queryidentification\"}",
            "did you mean QueryIdentification?",
        ),
        (
            "{\"message\":\"QueryIdentification\",\"code\":\"4B00\"}",
            "has the code 2B00h",
        ),
        ("{\"message\":\"QueryIdentification\"}", "QueryType"),
        (
            "{\"message\":\"QueryIdentification\",\"body\":{\"QueryTyp\":2}}",
            "QueryTyp",
        ),
        (
            "{\"message\":\"QueryIdentification\",\"body\":{\"QueryType\":300}}",
            "QueryType",
        ),
        (
            "{\"message\":\"QueryIdentification\",\"boddy\":{}}",
            "boddy",
        ),
        ("{\"body\":{}}", "give \\\"message\\\" or \\\"code\\\""),
        ("{\"code\":\"wrong\"}", "is not a message code"),
        ("{\"code\":\"D001\"}", "D001h"),
        (
            "{\"error\":\"cut\",\"offset\":1}",
            "this line is an error, not a message",
        ),
        ("[]", "not a JSON object"),
        ("{", "not a JSON object"),
        (
            "{\"message\":\"SetWrenchEffort\",\"body\":{\"PropulsiveLinearEffortX\":101}}",
            "-100",
        ),
        (
            "{\"message\":\"QueryIdentification\",\"service\":\"urn:jaus:jss:core:Events\",\"body\":{\"QueryType\":2}}",
            "urn:jaus:jss:core:Discovery",
        ),
    ] {
        let run = run(&["encode"], format!("{line}\n").as_bytes());
        assert!(run.stdout.contains(help), "{line}: {}", run.stdout);
        let error = run.only_line();
        assert!(
            error["error"].is_string() && error["offset"].is_u64(),
            "{error}"
        );
        assert_eq!(run.status, 1);
    }
}

#[test]
fn where_versions_differ_the_line_says_which_one_it_is_and_a_flag_chooses() {
    // Report Local Vector: version 1.0 of its service has a shorter presence vector than 1.1.
    let service = "urn:jaus:jss:mobility:LocalVectorDriver";
    let octets = b"084400\n";
    let by_itself = run(&["decode", "--hex"], octets);
    assert_eq!(by_itself.only_line()["version"], "1.0");
    let again = run(&["encode"], by_itself.stdout.as_bytes());
    assert_eq!(again.stdout.as_bytes(), octets);

    let old = format!("{service}@1.0");
    let chosen = run(&["decode", "--hex", "--service", &old], octets).only_line();
    assert_eq!(
        (chosen.get("version"), &chosen["service"]),
        (None, &service.into())
    );
    let new = format!("{service}@1.1");
    let refused = run(&["decode", "--hex", "--service", &new], octets);
    assert_eq!((refused.only_line().get("body"), refused.status), (None, 1));
}

#[test]
fn a_service_that_is_named_must_exist() {
    let run = run(
        &["decode", "--hex", "--service", "urn:jaus:jss:core:Event"],
        b"",
    );
    assert!(
        run.stderr.contains("did you mean urn:jaus:jss:core:Events"),
        "{}",
        run.stderr
    );
    assert_eq!(run.status, 2);
}

#[test]
fn definitions_that_cannot_be_loaded_are_refused() {
    let missing = run(&["decode", "--hex", "--jsidl", "no/such/folder"], b"");
    assert!(
        missing.stderr.contains("no/such/folder"),
        "{}",
        missing.stderr
    );
    assert_eq!(missing.status, 2);

    let file = std::env::temp_dir().join(format!("jaus-cli-{}.xml", std::process::id()));
    let text =
        "<service_def xmlns=\"urn:jaus:jsidl:1.0\" name=\"X\" id=\"urn:x\" version=\"1.0\"/>";
    std::fs::write(&file, text).unwrap();
    let path = file.to_str().unwrap();
    let wrong = run(&["decode", "--hex", "--jsidl", path], b"");
    std::fs::remove_file(&file).unwrap();
    assert!(
        wrong.stderr.contains(&format!("{path}:1:1: error:")),
        "{}",
        wrong.stderr
    );
    assert!(
        wrong.stderr.contains("no message definition"),
        "{}",
        wrong.stderr
    );
    assert_eq!(wrong.status, 2);
}
