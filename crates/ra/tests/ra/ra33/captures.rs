//! Recorded traffic of OpenJAUS 3.3.1.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use bytes::Bytes;
use jaus::codec::Message;
use jaus::wire::ra::{HEADER_LEN, Header};
use jaus::wire::{Frame, judp};
use jaus_ra::forgiving::forgiving;
use jaus_ra::messages::ra33;
use jaus_test_kit::evidence;
use jaus_view::{Capture, Datagram, Network};

use super::{Definitions, through_both};

/// Port between OpenJAUS's node manager and its components, used without framing.
const INNER_PORT: u16 = 24629;

/// The messages of a capture, each as code and data.
fn messages(file: &Path) -> Vec<Bytes> {
    let mut capture = Capture::new(File::open(file).unwrap()).unwrap();
    let mut network = Network::new([judp::PORT, INNER_PORT]);
    let mut messages = Vec::new();
    while let Some(frame) = capture.next_frame() {
        for datagram in network.handle_frame(&frame.unwrap()) {
            messages.extend(message(&datagram));
        }
    }
    messages
}

/// The message in a datagram: OpenJAUS sends one per datagram.
fn message(datagram: &Datagram<'_>) -> Option<Bytes> {
    let octets = Bytes::copy_from_slice(&datagram.payload);
    if datagram.source.port() != INNER_PORT && datagram.destination.port() != INNER_PORT {
        let frame: Frame = judp::frames(octets).unwrap().next().unwrap().unwrap();
        return Some(frame.payload);
    }
    let header = Header::decode(&octets).unwrap();
    assert_eq!(octets.len(), HEADER_LEN + header.data_size());
    Some(super::payload(header.code, &octets[HEADER_LEN..]))
}

#[test]
fn every_recorded_message_is_read_and_written_again_by_both_codecs() {
    let captures = evidence::captures().join("openjaus33");
    let definitions = Definitions::new();
    let mut counted = BTreeMap::new();
    for file in ["judp-wire", "opc-lo", "opc-wire", "peer-wire"] {
        for message in messages(&captures.join(format!("openjaus33-{file}.pcap"))) {
            let code = u16::from_le_bytes(*message.first_chunk().unwrap());
            let definition = definitions.of(code).unwrap();
            *counted.entry(definition.generated.name).or_insert(0) += 1;
            let mended = forgiving(&message, definition.generated.decode).unwrap();
            let mended = mended.encode().unwrap();
            let (again, _) = through_both(&definition, &mended);
            assert_eq!(again, mended);
            if definition.generated.name == "ConfirmEventRequest" {
                // Seven bits of its presence vector have no field.
                assert_eq!((message[2], mended[2]), (0xFF, 0x01));
                assert_eq!(message[3..], mended[3..]);
            } else {
                assert_eq!(mended, message, "{}", definition.generated.name);
            }
        }
    }
    println!("{counted:?}");
    assert_eq!(counted["SetWrenchEffort"], 1452);
    assert_eq!(counted["ReportGlobalPose"], 648);
    assert_eq!(counted["ReportVelocityState"], 648);
    assert_eq!(counted.len(), 19, "{counted:?}");
}

#[test]
fn the_recorded_vehicle_is_where_its_simulation_begins() {
    let captures = evidence::captures().join("openjaus33");
    let file = captures.join("openjaus33-opc-lo.pcap");
    let code = ra33::ReportGlobalPose::CODE.to_le_bytes();
    let poses = messages(&file).into_iter();
    let poses = poses.filter(|message| message.first_chunk() == Some(&code));
    let poses = poses.map(|message| {
        let pose = ra33::ReportGlobalPose::decode(&message).unwrap();
        (pose.latitude_deg().unwrap(), pose.longitude_deg().unwrap())
    });
    let mut poses = poses.peekable();
    assert!(poses.peek().is_some());
    for (latitude, longitude) in poses {
        assert!((latitude - 37.2136).abs() < 0.001, "{latitude}");
        assert!((longitude + 80.4376).abs() < 0.001, "{longitude}");
    }
}
