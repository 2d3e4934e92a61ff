//! `jaus jsidl explain`, `docs` and `schema`, run as processes.

use std::fs;
use std::path::PathBuf;

use crate::support::run;
use serde_json::Value as Json;

/// A recorded datagram: 1000.1.7 broadcasts Query Identification.
const DATAGRAM: &str = "02 00 11 00 09 ff ff ff ff 07 01 e8 03 00 2b 02 00 00";

#[test]
fn a_message_is_explained_octet_by_octet() {
    let run = run(&["jsidl", "explain", "00", "2B", "02"], b"");
    let expected = "\
QueryIdentification 2B00h of urn:jaus:jss:core:Discovery@1.1

offset  octets                   field             raw  meaning
     0  00 2B                    (message code)  2B00h  QueryIdentification
     2  02                       QueryType           2  Subsystem Identification
";
    assert_eq!(
        (run.stdout.as_str(), run.status),
        (expected, 0),
        "{}",
        run.stderr
    );
}

#[test]
fn a_client_service_explains_a_message_only_if_it_is_named() {
    let explained_by = |options: &[&str]| {
        let arguments = [&["jsidl", "explain", "00", "2B", "02"], options].concat();
        let run = run(&arguments, b"");
        run.stdout.lines().next().unwrap_or_default().to_owned()
    };
    let discovery = "QueryIdentification 2B00h of urn:jaus:jss:core:Discovery@1.1";
    let client = "QueryIdentification 2B00h of urn:jaus:jss:core:DiscoveryClient@1.1";
    assert_eq!(explained_by(&[]), discovery);
    assert_eq!(explained_by(&["--service", "Discovery@1.1"]), discovery);
    assert_eq!(explained_by(&["--service", "DiscoveryClient@1.1"]), client);
}

#[test]
fn a_datagram_is_recognised_and_its_header_explained() {
    for input in [DATAGRAM.to_owned(), DATAGRAM.replace(' ', ":")] {
        let run = run(&["jsidl", "explain", "--json", "-"], input.as_bytes());
        let line = run.only_line();
        assert_eq!(line["transport"], "judp2");
        assert_eq!(line["messages"][0]["message"], "QueryIdentification");
        let rows = line["rows"].as_array().unwrap();
        let octets: String = rows
            .iter()
            .map(|row| row["octets"].as_str().unwrap())
            .collect();
        assert_eq!(octets, DATAGRAM.replace(' ', ""));
        let named = |field: &str| rows.iter().find(|row| row["field"] == field).unwrap();
        assert_eq!(named("source")["name"], "1000.1.7");
        assert_eq!(named("QueryType")["offset"], 15);
        assert_eq!(run.status, 0);
    }
}

#[test]
fn older_headers_stale_octets_and_files_of_octets_are_explained_as_well() {
    // The same query in the first edition of AS5669, and three surplus octets.
    let octets: Vec<u8> = [
        &[1, 0, 0, 0, 17][..],
        &[
            6, 2, 0x00, 0x2B, 255, 255, 255, 255, 7, 1, 101, 0, 1, 0, 0, 0,
        ],
        &[2, 9, 9, 9],
    ]
    .concat();
    let directory = directory("older");
    let file = directory.join("message.bin");
    fs::write(&file, &octets).unwrap();
    let run = run(&["jsidl", "explain", "--json", file.to_str().unwrap()], b"");
    let line = run.only_line();
    let rows = line["rows"].as_array().unwrap();
    let told: String = rows
        .iter()
        .map(|row| row["octets"].as_str().unwrap())
        .collect();
    let all: String = octets.iter().map(|octet| format!("{octet:02x}")).collect();
    assert_eq!(told, all);
    assert_eq!(line["transport"], "judp1");
    assert_eq!(rows.last().unwrap()["kind"], "not read");
    let query = rows.iter().find(|row| row["field"] == "QueryType").unwrap();
    assert_eq!(
        (&query["offset"], &query["raw"]),
        (&Json::from(21), &Json::from(2))
    );
}

/// Recorded from OpenJAUS 3.3.1, which sets all bits of a presence vector: 20.1.35.1 confirms an
/// event to 10.1.1.1.
#[test]
fn messages_of_openjaus_are_explained_by_the_definitions_of_the_reference_architecture() {
    let message = "f301 ff 00 014b 00 0000 00";
    let header = "0602 f301 0101010a 01230114 0800 0000";
    let data = &message[5..];
    for (prefix, transport) in [("4a41555330312e30", "ra"), ("01 0000 0018", "judp1")] {
        let input = format!("{prefix} {header} {data}");
        let run = run(&["jsidl", "explain", "--json", &input], b"");
        let line = run.only_line();
        assert_eq!((run.status, &line["transport"]), (0, &transport.into()));
        assert_eq!(line["messages"][0]["service"], "urn:jaus-rs:ra33:Events");
        let rows = line["rows"].as_array().unwrap();
        let octets = rows.iter().map(|row| row["octets"].as_str().unwrap());
        assert_eq!(octets.collect::<String>(), input.replace(' ', ""));
        let vector = rows.iter().find(|row| row["kind"] == "presence vector");
        let note = "bits without a field are ignored";
        assert_eq!(vector.unwrap()["note"], note);
    }
    let run = run(&["jsidl", "explain", "--ra", message], b"");
    assert!(
        run.status == 0
            && run
                .stdout
                .starts_with("ConfirmEventRequest 01F3h of urn:jaus-rs:ra33"),
        "{run:?}"
    );
}

#[test]
fn a_message_that_only_the_reference_architecture_can_read_has_a_hint() {
    // Its Report Identification, whose name has a fixed length.
    let name = format!("004b 02 0000 00 {}", "4f".repeat(80));
    let run_it = run(&["jsidl", "explain", &name], b"");
    assert_eq!(run_it.status, 1);
    let hint = "it is a valid message of the Reference Architecture (OpenJAUS 3.x): add --ra";
    assert!(run_it.stdout.contains(hint), "{}", run_it.stdout);
    assert_eq!(run(&["jsidl", "explain", "--ra", &name], b"").status, 0);
}

#[test]
fn what_is_wrong_is_said_with_the_place_and_the_status() {
    let short = run(&["jsidl", "explain", "02440100 0000"], b"");
    assert_eq!(short.status, 1);
    assert!(
        short.stdout.contains(
            "Decoding stopped: ReportGlobalPose: Latitude: octets needed: 4, left: 2 at octet 4"
        ),
        "{}",
        short.stdout
    );
    for (input, said) in [
        ("nonsense", "neither a file nor hexadecimal digits"),
        ("FECA", "no loaded definition has the message code CAFEh"),
    ] {
        let run = run(&["jsidl", "explain", input], b"");
        assert_eq!((run.status, run.stdout.as_str()), (2, ""));
        assert!(run.stderr.contains(said), "{}", run.stderr);
    }
}

#[test]
fn documentation_and_schemas_of_the_built_in_services_are_written() {
    let directory = directory("made");
    for (arguments, made) in [
        (&["docs"][..], "index.html"),
        (&["docs"], "core.DiscoveryClient.1.1.html"),
        (&["docs", "--markdown"], "core.Discovery.1.1.md"),
        (&["schema"], "core.Discovery.1.1.schema.json"),
    ] {
        let arguments = [&["jsidl"], arguments, &["-o", directory.to_str().unwrap()]].concat();
        let run = run(&arguments, b"");
        assert_eq!((run.status, run.stderr.as_str()), (0, ""));
        let text = fs::read_to_string(directory.join(made)).unwrap();
        assert!(text.contains("QueryIdentification"), "{made}");
    }
    fs::write(directory.join("empty.xml"), "<a/>").unwrap();
    let file = directory.join("empty.xml");
    let run = run(
        &[
            "jsidl",
            "docs",
            file.to_str().unwrap(),
            "-o",
            directory.to_str().unwrap(),
        ],
        b"",
    );
    assert_eq!(run.status, 2);
    assert!(
        run.stderr.contains("no service is usable"),
        "{}",
        run.stderr
    );
}

/// An empty directory of this test's own.
fn directory(name: &str) -> PathBuf {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("jsidl-{name}"));
    let _ = fs::remove_dir_all(&directory);
    fs::create_dir_all(&directory).unwrap();
    directory
}
