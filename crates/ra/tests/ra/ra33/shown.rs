//! Display of frames with the older headers: by the Reference Architecture's definitions if the
//! source is one of its ids, and unchanged otherwise.

use std::fs::File;

use bytes::Bytes;
use jaus::wire::judp;
use jaus_ra::{forgiving, messages};
use jaus_test_kit::evidence;
use jaus_view::{Capture, Dictionary, MessageLog, Network};
use serde_json::Value;

fn dictionary() -> Dictionary {
    Dictionary::new()
        .with_reference_architecture(messages::registry(), forgiving::decode)
        .with_catalogue()
}

/// The lines of a capture as JSON.
fn lines(file: &str) -> Vec<Value> {
    let path = evidence::captures().join(file);
    let mut capture = Capture::new(File::open(path).unwrap()).unwrap();
    let dictionary = dictionary();
    let mut network = Network::new([judp::PORT]);
    let mut log = MessageLog::new(&dictionary);
    let mut lines = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.unwrap();
        for datagram in network.handle_frame(&frame) {
            let read = log.read(frame.time, &datagram);
            lines.extend(
                read.iter()
                    .map(|line| serde_json::from_str(&line.to_json()).unwrap()),
            );
        }
    }
    lines
}

#[test]
fn every_recorded_message_of_openjaus_is_shown_by_name_and_fields() {
    for (file, transport) in [("judp", "judp1"), ("opc", "ra"), ("peer", "ra")] {
        let lines = lines(&format!("openjaus33/openjaus33-{file}-wire.pcap"));
        for line in &lines {
            assert_eq!(line["transport"], transport);
            assert_eq!(
                line["source"].as_str().unwrap().split('.').count(),
                4,
                "{line}"
            );
            let service = line["service"].as_str().unwrap();
            assert!(service.starts_with("urn:jaus-rs:ra33:"), "{line}");
            assert!(
                line["body"].is_object() || line["body"].is_array(),
                "{line}"
            );
        }
        let configuration = lines.iter().find(|line| line["code"] == "4B01").unwrap();
        assert_eq!(configuration["body"][0]["NodeRec"]["NodeID"], 1);
    }
}

#[test]
fn messages_of_junior_through_the_older_headers_are_not_taken_for_others() {
    for file in [
        "junior/09-as5669-v1-msgid.pcap",
        "junior/10-opc-JAUS01.0.pcap",
    ] {
        for line in lines(file) {
            let service = line["service"].as_str().unwrap_or_default();
            assert!(!service.starts_with("urn:jaus-rs:ra33:"), "{line}");
        }
    }
}

/// A "JAUS01.0" datagram from 10.1.38.1 to 20.1.32.1.
fn datagram(code: u16, data: &[u8]) -> Bytes {
    let mut octets = b"JAUS01.0\x06\x02".to_vec();
    octets.extend(code.to_le_bytes());
    octets.extend([1, 32, 1, 20, 1, 38, 1, 10]);
    octets.extend((data.len() as u16).to_le_bytes());
    octets.extend([0, 0]);
    octets.extend(data);
    octets.into()
}

fn shown(datagram: &Bytes) -> Value {
    let dictionary = dictionary();
    let mut log = MessageLog::new(&dictionary);
    let line = log.read(
        None,
        &jaus_view::Datagram {
            source: ([10, 0, 0, 1], judp::PORT).into(),
            destination: ([10, 0, 0, 2], judp::PORT).into(),
            payload: datagram[..].into(),
            missing: 0,
            by_tcp: false,
        },
    );
    serde_json::from_str(&line[0].to_json()).unwrap()
}

#[test]
fn a_pose_is_shown_in_its_units_and_unused_bits_are_passed_over() {
    // Latitude a third of the way from the equator to the pole; the top two bits have no field.
    let line = shown(&datagram(0x4402, &[0x01, 0xC0, 0xAA, 0xAA, 0xAA, 0x2A]));
    assert_eq!(line["source"], "10.1.38.1");
    assert_eq!(line["message"], "ReportGlobalPose");
    assert_eq!(line["body"]["Latitude"], 30.0);
}

#[test]
fn what_does_not_fit_says_so_and_what_is_unknown_stays_octets() {
    let short = shown(&datagram(0x4402, &[0x01, 0x00, 0xAA]));
    assert_eq!(short["message"], "ReportGlobalPose");
    assert!(
        short["error"].as_str().unwrap().contains("Latitude"),
        "{short}"
    );
    let unknown = shown(&datagram(0xD123, &[1, 2]));
    assert_eq!(unknown["octets"], "23d10102");
    // A code of the JAUS services that the Reference Architecture lacks.
    let other = shown(&datagram(0x4407 + 0x20, &[1]));
    assert!(other.get("body").is_none(), "{other}");
}
