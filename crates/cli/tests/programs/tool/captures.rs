//! `jaus decode` on captures: generated here, and recorded from other implementations.

use etherparse::PacketBuilder;
use jaus_test_kit::evidence;

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use crate::support::{
    Message, RAW, block, enhanced_packet, interface, ip_packet, jaus, pcap, pcap_of, run,
    section_header,
};
use serde_json::Value as Json;

/// 42.1.1 queries the identification of 105.1.255's subsystem.
const QUERY_IDENTIFICATION: &[u8] = &[0x00, 0x2B, 0x02];

fn decode(capture: &[u8]) -> crate::support::Run {
    run(&["decode", "-"], capture)
}

#[test]
fn a_message_is_printed_with_the_promised_keys_in_their_order() {
    let run = decode(&pcap_of(&[Message::new(QUERY_IDENTIFICATION).datagram()]));
    assert_eq!(
        run.stdout,
        concat!(
            r#"{"time":"2015-06-08T16:36:58.436918Z","source":"42.1.1","destination":"105.1.255","#,
            r#""transport":"judp2","priority":"standard","broadcast":"global","ack":"none","#,
            r#""data":"single","sequence":1,"code":"2B00","message":"QueryIdentification","#,
            r#""service":"urn:jaus:jss:core:Discovery","body":{"QueryType":"Subsystem Identification"}}"#,
            "\n"
        )
    );
    assert_eq!((run.status, &*run.stderr), (0, ""));
}

#[test]
fn both_byte_orders_and_both_resolutions_of_pcap_are_read() {
    let little = pcap_of(&[Message::new(QUERY_IDENTIFICATION).datagram()]);
    let swapped = {
        let mut file = little.clone();
        // Magic number, both versions, four words; then four words for the packet.
        for field in [
            0..4,
            4..6,
            6..8,
            16..20,
            20..24,
            24..28,
            28..32,
            32..36,
            36..40,
        ] {
            file[field].reverse();
        }
        file
    };
    assert_eq!(decode(&swapped).stdout, decode(&little).stdout);
    let mut nanoseconds = little;
    nanoseconds[0] = 0x4d;
    nanoseconds[1] = 0x3c;
    assert_eq!(
        decode(&nanoseconds).only_line()["time"],
        "2015-06-08T16:36:58.000436918Z"
    );
}

#[test]
fn pcapng_blocks_that_are_not_packets_are_stepped_over() {
    let frame = ip_packet(&Message::new(QUERY_IDENTIFICATION).datagram());
    let simple = block(
        3,
        &[&(frame.len() as u32).to_le_bytes()[..], &frame].concat(),
    );
    let capture = [
        section_header(),
        block(4, &[0; 8]),
        interface(RAW, &[]),
        // Nanoseconds, and an unknown option.
        interface(
            RAW,
            &[9, 0, 1, 0, 9, 0, 0, 0, 99, 0, 2, 0, 1, 1, 0, 0, 0, 0, 0, 0],
        ),
        block(0x0BAD, &[1; 40]),
        enhanced_packet(0, 1_433_781_418_436_918, &frame),
        enhanced_packet(1, 1_433_781_418_436_918_001, &frame),
        simple,
        // A new section restarts the interface numbers; this one counts in 1/1024 seconds.
        section_header(),
        interface(RAW, &[9, 0, 1, 0, 0x8a, 0, 0, 0]),
        enhanced_packet(0, 1_433_781_418 << 10 | 512, &frame),
    ]
    .concat();
    let run = decode(&capture);
    let times: Vec<Json> = run.json().iter().map(|line| line["time"].clone()).collect();
    assert_eq!(times[0], "2015-06-08T16:36:58.436918Z");
    assert_eq!(times[1], "2015-06-08T16:36:58.436918001Z");
    assert_eq!(times[2], Json::Null, "a Simple Packet Block has no time");
    assert_eq!(times[3], "2015-06-08T16:36:58.500000000Z");
    assert_eq!((times.len(), run.status), (4, 0));
}

#[test]
fn a_damaged_pcapng_block_costs_no_other() {
    let frame = ip_packet(&Message::new(QUERY_IDENTIFICATION).datagram());
    let capture = [
        section_header(),
        interface(RAW, &[]),
        enhanced_packet(7, 0, &frame),
        enhanced_packet(0, 0, &frame),
        // Names that do not exist.
        block(4, &[1, 0, 0xFF, 0xFF]),
        // Interface 0, no time, and a claimed length of 100 octets, of which 8 are present.
        block(
            6,
            &[&[0; 12][..], &[100, 0, 0, 0, 100, 0, 0, 0], &[7; 8]].concat(),
        ),
        enhanced_packet(0, 0, &frame),
    ]
    .concat();
    let run = decode(&capture);
    let lines = run.json();
    assert_eq!(lines[0]["offset"], 28 + 20);
    assert!(
        lines[0]["error"]
            .as_str()
            .unwrap()
            .contains("not described")
    );
    assert_eq!(lines[1]["message"], "QueryIdentification");
    assert!(lines[2]["error"].as_str().unwrap().contains("too short"));
    assert_eq!(lines[3]["message"], "QueryIdentification");
    assert_eq!((lines.len(), run.status), (4, 1));
}

#[test]
fn a_capture_cut_short_anywhere_gives_what_it_holds_and_then_an_error() {
    let datagram = Message::new(QUERY_IDENTIFICATION).datagram();
    let capture = pcap_of(&[datagram.clone(), datagram]);
    let second = 24 + (capture.len() - 24) / 2;
    for length in [second + 1, second + 16, capture.len() - 1] {
        let run = decode(&capture[..length]);
        let lines = run.json();
        assert_eq!(lines.len(), 2, "{run:?}");
        assert_eq!(lines[0]["message"], "QueryIdentification");
        assert_eq!(lines[1]["offset"], second);
        assert!(
            lines[1]["error"].as_str().unwrap().contains("truncated"),
            "{run:?}"
        );
        assert_eq!(run.status, 1);
    }
    let whole = decode(&capture[..second]);
    assert_eq!((whole.json().len(), whole.status), (1, 0));
}

#[test]
fn what_is_no_capture_is_refused_with_advice() {
    for (input, advice) in [
        (&b""[..], "the file is empty"),
        (b"\x1f\x8b\x08\x00", "gunzip"),
        (b"hello, world", "pcap or pcapng"),
        (&[0xd4, 0xc3, 0xb2, 0xa1, 2, 0], "truncated"),
    ] {
        let run = decode(input);
        assert!(run.stderr.contains(advice), "{run:?}");
        assert_eq!((run.status, &*run.stdout), (2, ""));
    }
    let run = run(&["decode", "no/such/file.pcap"], b"");
    assert!(run.stderr.contains("no/such/file.pcap"), "{run:?}");
    assert_eq!(run.status, 2);
}

#[test]
fn several_messages_in_a_datagram_are_all_printed() {
    let datagram = [
        Message::new(QUERY_IDENTIFICATION).datagram(),
        Message::new(&[0x02, 0x22]).octets(),
    ]
    .concat();
    let run = decode(&pcap_of(&[datagram]));
    let names: Vec<Json> = run
        .json()
        .iter()
        .map(|line| line["message"].clone())
        .collect();
    assert_eq!(names, ["QueryIdentification", "QueryHeartbeatPulse"]);
    assert_eq!(run.status, 0);
}

#[test]
fn stale_octets_behind_a_message_are_passed_over_without_a_word() {
    let message = Message::new(QUERY_IDENTIFICATION);
    let unlikely_flags = Message {
        flags: 0x73,
        ..Message::new(b"stale")
    };
    let other_node = Message {
        source: 77 << 16 | 0x0101,
        ..Message::new(b"stale")
    };
    for tail in [
        &[0; 3][..],
        &[0; 40],
        b":Control\x01\x00\x1burn:jaus:jss",
        &unlikely_flags.octets(),
        &other_node.octets(),
    ] {
        let run = decode(&pcap_of(&[[&message.datagram()[..], tail].concat()]));
        assert_eq!(run.only_line()["message"], "QueryIdentification");
        assert_eq!((run.status, &*run.stderr), (0, ""));
    }
}

#[test]
fn a_datagram_that_is_no_jaus_gives_an_error_line() {
    let cut = &Message::new(QUERY_IDENTIFICATION).datagram()[..12];
    let run = decode(&pcap_of(&[b"hello".to_vec(), cut.to_vec()]));
    let lines = run.json();
    assert_eq!(lines[0]["offset"], 0);
    assert_eq!(lines[1]["offset"], 1);
    assert!(
        lines
            .iter()
            .all(|line| line["error"].is_string() && line["time"].is_string())
    );
    assert_eq!(run.status, 1);
}

#[test]
fn a_message_that_does_not_fit_its_definition_keeps_what_is_known_of_it() {
    let run = decode(&pcap_of(&[Message::new(&[0x00, 0x2B]).datagram()]));
    let line = run.only_line();
    assert_eq!(
        (&line["code"], &line["message"]),
        (&"2B00".into(), &"QueryIdentification".into())
    );
    assert_eq!(line["source"], "42.1.1");
    assert_eq!(line["offset"], 2);
    assert_eq!(line["octets"], "002b");
    assert_eq!(run.status, 1);
}

#[test]
fn an_unknown_code_is_an_error_that_names_it() {
    let run = decode(&pcap_of(&[Message::new(&[0x01, 0xD0, 0xAA]).datagram()]));
    let line = run.only_line();
    assert!(line["error"].as_str().unwrap().contains("D001h"));
    assert_eq!(
        (&line["code"], &line["octets"]),
        (&"D001".into(), &"01d0aa".into())
    );
    assert_eq!(run.status, 1);
}

#[test]
fn an_acknowledgement_has_no_message() {
    let acknowledgement = Message {
        flags: 0x31,
        ..Message::new(&[])
    };
    let run = decode(&pcap_of(&[acknowledgement.datagram()]));
    let line = run.only_line();
    assert_eq!((&line["ack"], line.get("code")), (&"ack".into(), None));
    assert_eq!(run.status, 0);
}

#[test]
fn a_large_message_is_shown_in_parts_and_then_whole_in_both_styles() {
    // Report Identification of a vehicle with a name of 30 letters, in three fragments.
    let whole = [&[0x00, 0x4B, 2, 0x11, 0x27, 30][..], &[b'v'; 30]].concat();
    let fragments = |code: &[u8]| {
        [
            (0x41, &whole[..12]),
            (0x81, &whole[12..24]),
            (0xC1, &whole[24..]),
        ]
        .iter()
        .zip(65_535..)
        .map(|(&(flags, part), sequence): (_, u32)| {
            let payload = if flags == 0x41 {
                part.to_vec()
            } else {
                [code, part].concat()
            };
            Message {
                flags,
                sequence: sequence as u16,
                ..Message::new(&payload)
            }
            .datagram()
        })
        .collect::<Vec<_>>()
    };
    for code in [&[][..], &[0x00, 0x4B]] {
        let run = decode(&pcap_of(&fragments(code)));
        let lines = run.json();
        let data: Vec<_> = lines
            .iter()
            .map(|line| line["data"].as_str().unwrap())
            .collect();
        assert_eq!(data, ["first", "middle", "last", "whole"]);
        assert_eq!(lines[0]["message"], "ReportIdentification");
        assert_eq!(lines[3]["body"]["Identification"], "v".repeat(30));
        assert_eq!((&lines[3]["sequence"], run.status), (&65_535.into(), 0));
    }
    let run = decode(&pcap_of(&fragments(&[])[..2]));
    assert!(run.stderr.contains("1 large message"), "{run:?}");
}

#[test]
fn messages_of_the_reference_architecture_are_read_and_written_without_their_headers() {
    let pose = "02440100aaaaaa2a\n";
    let read = run(&["decode", "--hex", "--ra"], pose.as_bytes());
    let line = read.only_line();
    assert_eq!(line["service"], "urn:jaus-rs:ra33:GlobalPoseSensor");
    assert_eq!(line["body"]["Latitude"], 30.0);
    // A decoded line names its service; a line without a service needs the flag.
    assert_eq!(run(&["encode"], read.stdout.as_bytes()).stdout, pose);
    let named = br#"{"message":"ReportGlobalPose","body":{"Latitude":30}}"#;
    assert_eq!(run(&["encode", "--ra"], named).stdout, pose);
    assert_ne!(run(&["encode"], named).stdout, pose);
}

#[test]
fn another_port_is_read_if_asked_for() {
    let capture = pcap_of(&[Message::new(QUERY_IDENTIFICATION).datagram()]);
    assert_eq!(run(&["decode", "-", "--port", "4000"], &capture).stdout, "");
    let both = run(
        &["decode", "-", "--port", "4000", "--port", "3794"],
        &capture,
    );
    assert_eq!(both.json().len(), 1);
}

#[test]
fn messages_are_recognised_on_any_port_and_what_was_skipped_is_said() {
    let packet = |payload: &[u8]| {
        let mut packet = Vec::new();
        PacketBuilder::ipv4([127, 0, 0, 1], [127, 0, 0, 2], 16)
            .udp(40_000, 50_000)
            .write(&mut packet, payload)
            .unwrap();
        packet
    };
    let message = Message::new(QUERY_IDENTIFICATION).datagram();
    let run = decode(&pcap(
        RAW,
        &[packet(b"of something else"), packet(&message)],
    ));
    assert_eq!(run.only_line()["message"], "QueryIdentification");
    let skipped = "note: 1 datagrams and TCP segments skipped: not on port 3794, and not JAUS";
    assert!(run.stderr.contains(skipped), "{run:?}");
}

#[test]
fn ethernet_with_a_vlan_tag_is_read() {
    let packet = ip_packet(&Message::new(QUERY_IDENTIFICATION).datagram());
    let frame = [&[2; 12][..], &[0x81, 0x00, 0x00, 0x07, 0x08, 0x00], &packet].concat();
    assert_eq!(decode(&pcap(1, &[frame])).only_line()["source"], "42.1.1");
}

#[test]
fn a_reader_that_goes_away_ends_the_run_quietly() {
    let folder = std::env::temp_dir().join(format!("jaus-cli-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("long.pcap");
    let datagram = Message::new(QUERY_IDENTIFICATION).datagram();
    std::fs::write(&file, pcap_of(&vec![datagram; 20_000])).unwrap();
    let mut child = jaus()
        .arg("decode")
        .arg(&file)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    assert!(line.contains("QueryIdentification"));
    let output = child.wait_with_output().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()));
}

#[test]
fn nobody_reading_the_errors_changes_nothing_else() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = jaus()
        .args(["-vv", "decode", "no/such/file.pcap"])
        .stdin(Stdio::null())
        .stderr(writer)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(2));
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let demo = jaus()
        .args(["-vvv", "demo", "--seconds", "0.2"])
        .stdout(Stdio::null())
        .stderr(writer)
        .status()
        .unwrap();
    assert_eq!(demo.code(), Some(0), "whatever is logged");
}

#[test]
fn every_recorded_capture_is_read_and_its_messages_are_named() {
    for (file, messages, errors) in RECORDED {
        let Some(path) = evidence::capture(file) else {
            continue;
        };
        let run = run(&["decode", path.to_str().unwrap()], b"");
        let lines = run.json();
        let failed: Vec<_> = lines
            .iter()
            .filter(|line| line.get("error").is_some())
            .collect();
        assert_eq!(
            (lines.len(), failed.len()),
            (*messages, *errors),
            "{file}: {failed:?}"
        );
        let has = |line: &Json, key| line.get(key).is_some();
        let nameless = lines
            .iter()
            .find(|line| has(line, "code") && !has(line, "message") && line["code"] != "D7A0");
        assert_eq!(nameless, None, "{file}");
        assert_eq!(run.status, i32::from(*errors > 0), "{file}");
    }
}

/// File, number of lines, and number of error lines.
///
/// The unreadable messages are wrong in the recording: answers of the judged team (igvc2015) and
/// test payloads of Junior and of JAUS++ (D7A0h).
const RECORDED: &[(&str, usize, usize)] = &[
    ("SAE_Management_PacketCapture.pcap", 22, 0),
    ("igvc2015/interface_test_1_13pts.pcapng", 3657, 13),
    ("igvc2015/qualification-practive-2015.pcap.pcapng", 91, 0),
    ("jauspp/01-vehsim-client.pcap", 450, 0),
    ("jauspp/02-rawvehicle-client.pcap", 283, 0),
    ("jauspp/05-jcopc-challenge2010.pcap", 270, 0),
    ("jauspp/06-jtcp.pcap", 50, 12),
    ("jauspp/07-cop-challenge2010.pcap", 71, 0),
    ("junior/01-discovery-then-unicast.pcap", 17, 16),
    ("junior/02-acked-small.pcap", 2, 1),
    ("junior/03-acked-100KB.pcap", 53, 2),
    ("junior/04-unacked-100KB-bigbuf.pcap", 28, 2),
    ("junior/05-unacked-100KB-default-loss.pcap", 28, 2),
    ("junior/06-global-broadcast.pcap", 2, 2),
    ("junior/07-subsystem-wildcard.pcap", 1, 1),
    ("junior/08-ack-timeout-no-peer.pcap", 4, 4),
    ("junior/09-as5669-v1-msgid.pcap", 2, 1),
    ("junior/10-opc-JAUS01.0.pcap", 2, 0),
    ("junior/11-priority0-bug.pcap", 3, 1),
    ("junior/12-priority15.pcap", 2, 1),
    ("junior/13-jtcp.pcap", 16, 16),
    ("junior/14-jtcp-64KB.pcap", 19, 2),
    ("openjaus33/openjaus33-judp-wire.pcap", 48, 0),
    ("openjaus33/openjaus33-opc-lo.pcap", 0, 0),
    ("openjaus33/openjaus33-opc-wire.pcap", 163, 0),
    ("openjaus33/openjaus33-peer-wire.pcap", 48, 0),
];
