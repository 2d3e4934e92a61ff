//! Valid and malformed datagrams and streams: dissected without a dissector error.

use jaus_test_kit::tools::has_tshark;
use jsidl::Library;
use roxmltree::Document;

use super::packets::{Packets, as5669a};
use super::tshark;

/// Report Identification of a vehicle called "Rover".
const IDENTIFICATION: &[u8] = b"\x00\x4B\x02\x11\x27\x05Rover";
/// Query Identification.
const QUERY: &[u8] = b"\x00\x2B\x02";

fn library() -> Library {
    let mut loader = jsidl::Loader::new();
    loader.catalogue().reference_architecture();
    loader.load().library
}

/// The PDML that tshark prints for the packets; `None` without tshark.
fn dissect(test: &str, packets: &Packets) -> Option<String> {
    if !has_tshark() {
        return None;
    }
    let directory = tshark::directory(test);
    let capture = directory.join("packets.pcap");
    packets.write(&capture);
    Some(tshark::pdml(&library(), &directory, &capture))
}

/// The summaries of the messages in each packet.
fn summaries(pdml: &Document<'_>) -> Vec<Vec<String>> {
    let packets = tshark::packets(pdml).into_iter();
    let summary = |item: roxmltree::Node<'_, '_>| item.attribute("showname").unwrap().to_owned();
    packets
        .map(|packet| tshark::messages(packet).into_iter().map(summary).collect())
        .collect()
}

#[test]
fn messages_in_one_datagram_are_told_apart_from_stale_octets() {
    let mut packets = Packets::new();
    let [one, two] = [as5669a(0, 1, QUERY), as5669a(0, 2, IDENTIFICATION)];
    packets.datagram(&[&[2], &one[..], &two[..], &IDENTIFICATION[..7]].concat());
    let Some(pdml) = dissect("several", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let packet = tshark::packets(&pdml)[0];
    assert_eq!(
        summaries(&pdml)[0],
        [
            "JAUS, QueryIdentification 42.1.1 -> 101.1.1",
            "JAUS, ReportIdentification 42.1.1 -> 101.1.1",
            "JAUS, octets behind the last message",
        ]
    );
    let message = tshark::messages(packet)[1];
    let shown = |field| tshark::show(message, field).unwrap_or_default().to_owned();
    assert_eq!(shown("jaus.source"), "42.1.1");
    assert_eq!(shown("jaus.destination.subsystem"), "101");
    assert_eq!(shown("jaus.sequence"), "2");
    assert_eq!(shown("jaus.code"), "0x4b00");
    assert_eq!(shown("jaus.message"), "ReportIdentification");
    assert_eq!(shown("jaus.reportidentification.identification"), "Rover");
    assert!(tshark::experts(packet, "jaus.malformed").is_empty());
}

#[test]
fn older_headers_are_read() {
    let mut packets = Packets::new();
    let header = b"\x16\x02\x00\x2B\x01\x01\x02\x00\x01\x01\x01\x00\x01\x00\x07\x00";
    packets.datagram(&[b"\x01\x00\x00\x00\x11", &header[..], b"\x02"].concat());
    packets.datagram(&[b"JAUS01.0", &header[..], b"\x02"].concat());
    packets.datagram(&[b"\x01\x40\x00\x00\x11", &header[..], b"\x02"].concat());
    let Some(pdml) = dissect("older", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let packets = tshark::packets(&pdml);
    assert_eq!(tshark::show(packets[0], "jaus.transport"), Some("1"));
    assert_eq!(
        tshark::show(packets[0], "jaus.queryidentification.querytype"),
        Some("2")
    );
    assert_eq!(tshark::show(packets[1], "jaus.transport"), Some("0"));
    assert_eq!(tshark::show(packets[1], "jaus.source"), Some("0.1.1.1"));
    assert_eq!(tshark::show(packets[1], "jaus.sequence"), Some("7"));
    assert_eq!(
        tshark::experts(packets[2], "jaus.malformed"),
        ["the header is compressed"]
    );
}

/// As recorded from OpenJAUS: all bits of a presence vector are set, and a name ends early.
#[test]
fn messages_of_the_reference_architecture_are_read_by_its_own_definitions() {
    let mut packets = Packets::new();
    let header = |code: &[u8; 2], length: u8| {
        let ids = b"\x01\x01\x01\x0A\x01\x23\x01\x14";
        [b"\x06\x02", &code[..], ids, &[length, 0, 0, 0]].concat()
    };
    let confirmed = b"\xFF\x00\x01\x4B\x00\x00\x00\x00";
    let named = b"\x02\x00\x00\x00OJ";
    let prefix = [1, 0, 0, 0, 22];
    packets.datagram(&[b"JAUS01.0", &header(b"\xF3\x01", 8)[..], confirmed].concat());
    packets.datagram(&[&prefix, &header(b"\x00\x4B", 6)[..], named].concat());
    packets.datagram(&[b"JAUS01.0", &header(b"\x23\xD1", 1)[..], b"\x07"].concat());
    packets.datagram(&[b"JAUS01.0", &header(b"\x02\x44", 3)[..], b"\x01\x00\xAA"].concat());
    let Some(pdml) = dissect("reference-architecture", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let ids = "20.1.35.1 -> 10.1.1.1";
    assert_eq!(
        summaries(&pdml).concat(),
        [
            format!("JAUS, ConfirmEventRequest {ids}"),
            format!("JAUS, ReportIdentification {ids}"),
            format!("JAUS, RA message D123h {ids}"),
            format!("JAUS, ReportGlobalPose {ids}"),
        ]
    );
    let packets = tshark::packets(&pdml);
    for (packet, field, shown) in [
        (0, "jaus.ra.confirmeventrequest.reportcode", "19201"),
        (0, "jaus.service", "urn:jaus-rs:ra33:Events 3.3"),
        (1, "jaus.ra.reportidentification.identification", "OJ"),
        (1, "jaus.source", "20.1.35.1"),
        (1, "jaus.source.component", "35"),
        (1, "jaus.source.instance", "1"),
    ] {
        assert_eq!(tshark::show(packets[packet], field), Some(shown), "{field}");
    }
    let faults = packets
        .iter()
        .map(|it| tshark::experts(*it, "jaus.malformed").len());
    assert_eq!(faults.collect::<Vec<_>>(), [0, 0, 0, 1]);
}

#[test]
fn header_compression_fields_are_read_past() {
    let mut packets = Packets::new();
    let offered =
        b"\x02\x40\x13\x00\xAA\x0C\x01\x01\x01\x02\x00\x01\x01\x01\x00\x00\x2B\x02\x05\x00";
    packets.datagram(offered);
    let Some(pdml) = dissect("compression", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let packet = tshark::packets(&pdml)[0];
    assert_eq!(tshark::show(packet, "jaus.hc_length"), Some("12"));
    assert_eq!(
        tshark::show(packet, "jaus.message"),
        Some("QueryIdentification")
    );
}

#[test]
fn fragments_in_any_order_and_style_make_the_message() {
    let name = [b'x'; 200];
    let message = [&IDENTIFICATION[..5], &[200], &name[..]].concat();
    let (first, rest) = message.split_at(90);
    let (second, third) = rest.split_at(90);
    let mut packets = Packets::new();
    for (data_control, sequence, piece) in [(2, 0, second), (3, 1, third), (1, 65_535, first)] {
        packets.datagram(&[&[2], &as5669a(data_control, sequence, piece)[..]].concat());
    }
    // JAUS++ repeats the code.
    let again = [&message[..2], rest].concat();
    for (data_control, sequence, piece) in [(1, 7, first), (3, 8, &again[..])] {
        packets.datagram(&[&[2], &as5669a(data_control, sequence, piece)[..]].concat());
    }
    let Some(pdml) = dissect("fragments", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let packets = tshark::packets(&pdml);
    let text = std::str::from_utf8(&name).unwrap();
    for (place, parts) in [(2, 3), (4, 2)] {
        let shown = tshark::show(packets[place], "jaus.reportidentification.identification");
        assert_eq!(shown, Some(text));
        assert_eq!(
            summaries(&pdml)[place],
            [format!(
                "JAUS, ReportIdentification (from {parts} fragments) 42.1.1 -> 101.1.1"
            )]
        );
        assert!(tshark::experts(packets[place], "jaus.malformed").is_empty());
    }
}

#[test]
fn streams_are_read_however_they_are_cut() {
    let mut packets = Packets::new();
    let mut position = 0;
    let mut send = |octets: &[u8]| {
        packets.segment(position, octets);
        position += u32::try_from(octets.len()).unwrap();
    };
    let [one, two] = [as5669a(0, 1, QUERY), as5669a(0, 2, IDENTIFICATION)];
    // The version octet once or before each message, in its own segment or not.
    send(&[2]);
    send(&one);
    send(&[&[2], &two[..10]].concat());
    send(&[&two[10..], &one[..], &two[..1]].concat());
    send(&two[1..]);
    let Some(pdml) = dissect("stream", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let found: Vec<_> = summaries(&pdml).concat();
    let [query, report] =
        ["Query", "Report"].map(|kind| format!("JAUS, {kind}Identification 42.1.1 -> 101.1.1"));
    assert_eq!(found, [&query, &report, &query, &report].map(String::clone));
}

#[test]
fn a_stream_of_the_first_edition_is_read() {
    let message = b"\x00\x11\x16\x02\x00\x2B\x01\x01\x02\x00\x01\x01\x01\x00\x01\x00\x07\x00\x02";
    let stream = [b"\x01", &message[..], &message[..], &message[..]].concat();
    let mut packets = Packets::new();
    packets.segment(0, &stream[..30]);
    packets.segment(30, &stream[30..]);
    let Some(pdml) = dissect("first-edition", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let found: Vec<_> = summaries(&pdml).concat();
    assert_eq!(found, vec!["JAUS, QueryIdentification 1.1.1 -> 2.1.1"; 3]);
}

#[test]
fn what_does_not_fit_its_definition_is_said_with_its_place() {
    let bad: [(&[u8], &str); 6] = [
        (
            &IDENTIFICATION[..8],
            "ReportIdentification, octet 4 of the body: octets needed: 5, left: 2",
        ),
        (
            b"\x00\x2B",
            "octet 0 of the body: octets needed: 1, left: 0",
        ),
        (
            b"\x00\x2B\x02\x03",
            "octet 1 of the body: octets behind the message's end: 1",
        ),
        (b"\x02", "a message starts with the two octets of its code"),
        // Query Velocity State with a presence vector is a plain field; its report's is not.
        (b"\x04\x44\x00\xF8", "the presence vector has bits above"),
        // Set Element: a list that is shorter than its count.
        (b"\x1A\x04\x01\xFF", "octets needed: 2, left: 0"),
    ];
    let mut packets = Packets::new();
    for (octets, _) in bad {
        packets.message(octets);
    }
    packets.datagram(b"\x02\x00\xFF\x00\x01\x01\x01\x02\x00\x01\x01\x01\x00\x00\x2B\x02\x05\x00");
    packets.datagram(b"\x02\x00");
    packets.datagram(b"\x02");
    packets.datagram(b"\x07what is this");
    let Some(pdml) = dissect("malformed", &packets) else {
        return;
    };
    let pdml = Document::parse(&pdml).unwrap();
    let packets = tshark::packets(&pdml);
    for (packet, (octets, sentence)) in packets.iter().zip(bad) {
        let found = tshark::experts(*packet, "jaus.malformed");
        assert!(
            found.len() == 1 && found[0].contains(sentence),
            "{octets:02X?}: {found:?} without {sentence:?}"
        );
    }
    for packet in &packets[6..9] {
        assert_eq!(tshark::experts(*packet, "jaus.malformed").len(), 1);
    }
    assert_eq!(tshark::messages(packets[9]).len(), 0);
}

#[test]
fn every_prefix_of_a_message_is_dissected_without_an_error_of_the_script() {
    let mut packets = Packets::new();
    let datagram = [&[2], &as5669a(0, 2, IDENTIFICATION)[..]].concat();
    for length in 1..datagram.len() {
        packets.datagram(&datagram[..length]);
    }
    for message in [
        IDENTIFICATION,
        b"\x1A\x04\x01\x02\x01\x00\x02\x00\x03\x00\x00\x03\x00\x00\x2B\x02",
    ] {
        for length in 0..message.len() {
            packets.datagram(&[&[2], &as5669a(0, 2, &message[..length])[..]].concat());
        }
    }
    dissect("prefixes", &packets);
}
