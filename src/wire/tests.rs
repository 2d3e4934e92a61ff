//! Frames recorded from Junior, JAUS++ and OpenJAUS, and invalid frames.

use bytes::{Bytes, BytesMut};
use proptest::prelude::*;

use super::*;

pub(super) fn hex(text: &str) -> Bytes {
    let digits: Vec<u8> = text.bytes().filter(u8::is_ascii_hexdigit).collect();
    let octet = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(octet).collect()
}

fn only_frame(datagram: &str) -> Frame {
    let mut frames = judp::frames(hex(datagram)).unwrap();
    let frame = frames.next().unwrap().unwrap();
    assert_eq!(frames.next(), None);
    assert_eq!(frames.remaining(), 0);
    frame
}

fn error(datagram: &str) -> String {
    match judp::frames(hex(datagram)) {
        Ok(mut frames) => {
            let error = frames.next().unwrap().unwrap_err();
            assert_eq!(
                frames.next(),
                None,
                "nothing can follow what cannot be read"
            );
            error
        }
        Err(error) => error,
    }
    .to_string()
}

/// Junior: the first message to an unknown id, multicast with a request for acknowledgement.
const JUNIOR_FIRST: &str =
    "02 00 1e00 19 01010200 01010100 014b 00000000 7878787878787878 7878 0100";
/// Junior: its acknowledgement.
const JUNIOR_ACK: &str = "02 00 0e00 31 01010100 01010200 0100";
/// Junior: AS5669 first edition, and its acknowledgement.
const JUNIOR_V1: &str =
    "01 00000020 1602 014b 01010200 01010100 1000 0100 78787878787878787878787878787878";
const JUNIOR_V1_ACK: &str = "01 00000010 3602 014b 01010100 01010200 0000 0100";
/// OpenJAUS 3.3: a heartbeat.
const OPENJAUS_HEARTBEAT: &str = "4a41555330312e30 0602 0242 0101ffff 0123010a 0000 0000";

#[test]
fn a_recorded_message_is_read_and_written_again() {
    let frame = only_frame(JUNIOR_FIRST);
    assert_eq!(frame.version, Version::As5669a);
    assert_eq!(frame.kind, Kind(0));
    assert_eq!(frame.flags, Flags(0x19));
    assert_eq!(frame.destination, JausId::new(2, 1, 1));
    assert_eq!(frame.source, JausId::new(1, 1, 1));
    assert_eq!(frame.sequence, 1);
    assert_eq!(frame.code(), Some(0x4B01));
    assert_eq!(frame.payload.len(), 16);
    assert!(frame.is_plausible() && !frame.is_acknowledgement());
    assert_eq!(judp::encode(&frame).unwrap(), hex(JUNIOR_FIRST));
}

#[test]
fn a_recorded_acknowledgement_is_fourteen_octets_without_payload() {
    let frame = only_frame(JUNIOR_ACK);
    assert_eq!(frame.flags.acknowledgement(), Acknowledgement::Positive);
    assert!(frame.payload.is_empty() && frame.is_acknowledgement() && frame.is_plausible());
    assert_eq!(frame.code(), None);
    assert_eq!(judp::encode(&frame).unwrap(), hex(JUNIOR_ACK));
}

#[test]
fn the_payload_is_shared_with_the_datagram() {
    let datagram = hex(JUNIOR_FIRST);
    let range = datagram.as_ptr_range();
    let frame = judp::frames(datagram).unwrap().next().unwrap().unwrap();
    assert!(range.contains(&frame.payload.as_ptr()));
}

#[test]
fn several_messages_share_a_datagram() {
    let second = &JUNIOR_ACK[2..];
    let datagram = hex(&format!("{JUNIOR_FIRST}{second}{second}"));
    let frames: Vec<_> = judp::frames(datagram)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(frames[0], only_frame(JUNIOR_FIRST));
    assert_eq!(
        frames[1..],
        [only_frame(JUNIOR_ACK), only_frame(JUNIOR_ACK)]
    );
}

/// JAUS++ sends a short message from the buffer of a longer one, whose end follows. Both tails were
/// recorded. The second looks like a message from 29295.99.58 with a fitting size, but is an
/// acknowledgement with a payload.
#[test]
fn stale_octets_behind_a_message_end_the_reading_quietly() {
    let message = "02 00 1100 01 0701e803 02019800 002b02 1200";
    for stale in [
        "6a6175733a6a73733a636f72653a54696d65",
        "001e00733a6a73733a636f72653a446973636f76657279010010616263646566",
    ] {
        let mut frames = judp::frames(hex(&format!("{message}{stale}"))).unwrap();
        assert_eq!(frames.next().unwrap().unwrap(), only_frame(message));
        assert_eq!(frames.next(), None);
        assert_eq!(frames.remaining(), hex(stale).len());
        assert_eq!(frames.offset(), hex(message).len());
    }
}

#[test]
fn the_faulty_flags_of_juniors_priority_zero_are_read_as_they_are() {
    let frame =
        only_frame("02 00 1e00 ff 01010200 01010100 014b 7878787878787878787878787878 0200");
    assert_eq!(frame.flags.priority(), Priority::SafetyCritical);
    assert_eq!(frame.flags.broadcast(), None);
    assert_eq!(frame.flags.acknowledgement(), Acknowledgement::Positive);
    assert_eq!(frame.flags.data(), DataControl::Last);
    assert!(!frame.is_acknowledgement() && !frame.is_plausible());
    assert_eq!(judp::encode(&frame).unwrap()[4], 0xFF);
}

#[test]
fn header_compression_fields_are_read_past_and_never_written() {
    let offered = only_frame("02 40 1300 aa0c 01 01010200 01010100 002b02 0500");
    assert_eq!((offered.kind.compression(), offered.sequence), (1, 5));
    assert_eq!(
        (offered.source, offered.payload),
        (JausId::new(1, 1, 1), hex("002b02"))
    );
    let frame = only_frame("02 40 1300 aa0c 01 01010200 01010100 002b02 0500");
    assert_eq!(judp::encode(&frame), Err(EncodeError::NotPlain));
    assert_eq!(
        error("02 40 0f00 aa0c 01 01010200 01010100 0500"),
        "octet 1: the data size 15 is less than the 16 octets of a message without payload"
    );
}

#[test]
fn the_code_of_an_older_header_is_moved_in_front_of_the_payload() {
    let frame = only_frame(JUNIOR_V1);
    assert_eq!(frame.version, Version::As5669);
    assert_eq!(
        (frame.source, frame.destination),
        (JausId::new(1, 1, 1), JausId::new(2, 1, 1))
    );
    assert_eq!(
        frame.flags,
        Flags::default().with_acknowledgement(Acknowledgement::Request)
    );
    assert_eq!(
        (frame.code(), frame.payload.len(), frame.sequence),
        (Some(0x4B01), 18, 1)
    );

    let heartbeat = only_frame(OPENJAUS_HEARTBEAT);
    assert_eq!(
        (heartbeat.version, heartbeat.code()),
        (Version::Ra, Some(0x4202))
    );
    assert_eq!(heartbeat.payload, hex("0242"));
    assert_eq!(heartbeat.flags.broadcast(), Some(Broadcast::Global));
    assert_eq!(ra::RaId::from(heartbeat.source).to_string(), "10.1.35.1");
    assert_eq!(
        ra::RaId::from(heartbeat.destination).to_string(),
        "255.255.1.1"
    );
    assert_eq!(
        JausId::from(ra::RaId::from(heartbeat.source)),
        heartbeat.source
    );
}

#[test]
fn older_headers_are_written_as_their_peers_write_them() {
    // Junior writes the length of header and data here, big-endian; with 16 octets of data it is
    // 20h.
    for recorded in [JUNIOR_V1, JUNIOR_V1_ACK, OPENJAUS_HEARTBEAT] {
        assert_eq!(
            judp::encode(&only_frame(recorded)).unwrap(),
            hex(recorded),
            "{recorded}"
        );
    }
    assert!(only_frame(JUNIOR_V1_ACK).is_acknowledgement());
}

#[test]
fn an_ra_header_tells_what_a_frame_does_not() {
    let datagram = hex("4a41555330312e30 c602 0244 01210114 0123010a 0400 0000 00000000");
    let header = ra::Header::decode(&datagram[8..]).unwrap();
    assert!(header.service_connection() && header.experimental());
    assert_eq!(
        (
            header.priority(),
            header.header_version(),
            header.data_size()
        ),
        (6, 2, 4)
    );
}

#[test]
fn a_header_tells_its_ids_and_its_length_with_and_without_compression() {
    for (octets, length) in [
        ("00 1e00 19 01010200 01010100", 12),
        ("40 1300 aa0c 01 01010200 01010100", 14),
    ] {
        let header = as5669a::Header::decode(&hex(octets)).unwrap();
        assert_eq!(header.wire_len(), length);
        assert_eq!(header.destination(), JausId::new(2, 1, 1));
        assert_eq!(header.source(), JausId::new(1, 1, 1));
        let mut out = BytesMut::new();
        let written = header.encode(&mut out).map(|()| out.freeze());
        let plain = (length == 12).then(|| hex(octets));
        assert_eq!(written, plain.ok_or(EncodeError::NotPlain));
    }
    assert_eq!(as5669a::message_len(16), 30);
}

#[test]
fn an_ra_header_is_written_from_its_fields_and_read_back() {
    let plain = ra::Fields {
        priority: 6,
        acknowledgement: Acknowledgement::Positive,
        service_connection: false,
        experimental: false,
        code: 0x4402,
        destination: ra::RaId::new(1, 33, 1, 20),
        source: ra::RaId::new(1, 35, 10, 1),
        data_flag: 4,
        data_size: 300,
        sequence: 0x0102,
    };
    let beyond = ra::Fields {
        priority: 16,
        service_connection: true,
        data_flag: 0x18,
        data_size: ra::MAX_DATA + 1,
        ..plain
    };
    let experimental = ra::Fields {
        experimental: true,
        ..plain
    };
    let (short, longest) = ((6, 4, 300), (15, 8, ra::MAX_DATA));
    for (fields, expected) in [(plain, short), (beyond, longest), (experimental, short)] {
        let written = ra::Header::new(&fields).octets();
        let header = ra::Header::decode(&written).unwrap();
        let read = (header.priority(), header.data_flag(), header.data_size());
        assert_eq!(read, expected);
        assert_eq!(header.service_connection(), fields.service_connection);
        assert_eq!(header.experimental(), fields.experimental);
        assert_eq!(header.acknowledgement(), fields.acknowledgement);
        assert_eq!(header.source(), fields.source.into());
        assert_eq!(header.destination(), fields.destination.into());
        assert_eq!((header.code, header.sequence), (0x4402, 0x0102));
        assert_eq!(header.header_version(), 2);
    }
}

#[test]
fn sixteen_priorities_of_the_reference_architecture_are_four_here() {
    let read = |properties: u8| {
        let rest = "02 0142 0101ffff 0123010a 0000 0000";
        only_frame(&format!("4a41555330312e30 {properties:02x} {rest}"))
    };
    for (priority, from) in [
        (Priority::Low, 0..=5),
        (Priority::Standard, 6..=8),
        (Priority::High, 9..=11),
        (Priority::SafetyCritical, 12..=15),
    ] {
        for value in from.clone() {
            assert_eq!(read(value).flags.priority(), priority, "{value}");
        }
        let written = judp::encode(&read(*from.start())).unwrap();
        assert!(from.contains(&(written[8] & 0xF)), "{priority}");
    }
}

#[test]
fn a_frame_is_plausible_only_if_all_of_its_header_is() {
    let (source, destination) = (JausId::new(1, 1, 1), JausId::from_u32(u32::MAX));
    let payload = Bytes::from_static(b"\x00\x2B");
    let sound = Frame::new(source, destination, payload);
    assert!(sound.is_plausible());
    let ack = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let changes: [fn(&mut Frame); 4] = [
        |frame| frame.kind = Kind(1),
        |frame| frame.source = frame.destination,
        |frame| frame.destination = JausId::from_u32(0),
        |frame| frame.flags = Flags(0x0D),
    ];
    for change in changes {
        let mut frame = sound.clone();
        change(&mut frame);
        assert!(!frame.is_plausible(), "{frame:?}");
    }
    for (version, payload, plausible) in [
        (Version::As5669a, &b""[..], true),
        (Version::As5669a, b"\x00\x2B", false),
        (Version::As5669, b"\x00\x2B", true),
        (Version::Ra, b"\x00\x2B!", false),
    ] {
        let answer = Frame {
            version,
            flags: ack,
            payload: Bytes::from_static(payload),
            ..sound.clone()
        };
        assert_eq!(answer.is_plausible(), plausible, "{answer:?}");
        assert_eq!(answer.is_acknowledgement(), plausible, "{answer:?}");
    }
}

#[test]
fn each_framing_writes_its_own_form_of_a_frame() {
    let frame = only_frame(JUNIOR_FIRST);
    for (framing, written) in [
        (Framing::Judp, judp::encode(&frame)),
        (Framing::Jtcp, jtcp::encode(&frame)),
        (Framing::Jserial, jserial::encode(&frame)),
    ] {
        assert_eq!(framing.encode(&frame), written, "{framing:?}");
    }
    let names = [Version::As5669a, Version::As5669, Version::Ra].map(|it| it.to_string());
    assert_eq!(names, ["judp2", "judp1", "ra"]);
}

#[test]
fn an_ra_datagram_holds_one_message_only() {
    let mut frames = judp::frames(hex(&format!("{OPENJAUS_HEARTBEAT} 0602024201"))).unwrap();
    assert!(frames.next().unwrap().is_ok());
    assert_eq!((frames.next(), frames.remaining()), (None, 5));
}

#[test]
fn what_is_wrong_with_a_datagram_is_said_with_its_place() {
    assert_eq!(error(""), "octet 0: the datagram is empty");
    assert_eq!(
        error("03 00"),
        "octet 0: no JAUS transport starts with 03h (AS5669A: 02h, AS5669: 01h, RA: \"JAUS01.0\")"
    );
    assert!(
        error("4a41555330322e30 0602").starts_with("octet 0: no JAUS transport starts with 4Ah")
    );
    assert_eq!(
        error("02 00 0e00"),
        "octet 1: a header takes 14 octets, but only 3 are left"
    );
    assert_eq!(
        error("02 00 0d00 31 01010100 01010200 0100"),
        "octet 1: the data size 13 is less than the 14 octets of a message without payload"
    );
    assert_eq!(
        error("02 00 1e00 31 01010100 01010200 0100"),
        "octet 1: the data size 30 is more than the 14 octets that are left"
    );
    assert_eq!(
        error("01 00000010 3602"),
        "octet 1: a header takes 20 octets, but only 6 are left"
    );
    assert_eq!(
        error("01 00400010 3602 014b 01010100 01010200 0000 0100"),
        "octet 1: the header is compressed, which is not supported"
    );
    assert_eq!(
        error("01 00000010 3602 014b 01010100 01010200 0500 0100"),
        "octet 5: the data size 5 is more than the 0 octets that are left"
    );
    assert_eq!(
        error("4a41555330312e30 0602 0242 0101ffff 0123010a 0030 0000"),
        "octet 8: the data control 3 is not defined (0 single, 1 first, 2 or 4 middle, 8 last)"
    );
}

#[test]
fn a_frame_that_its_header_cannot_carry_is_not_written() {
    let (source, destination) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
    let frame = |version, length| Frame {
        version,
        ..Frame::new(source, destination, Bytes::from(vec![0; length]))
    };
    let too_long = |length, limit| Err(EncodeError::PayloadTooLong { length, limit });
    assert_eq!(
        judp::encode(&frame(Version::As5669a, 65_522)),
        too_long(65_522, 65_521)
    );
    assert!(judp::encode(&frame(Version::As5669a, 65_521)).is_ok());
    assert_eq!(
        judp::encode(&frame(Version::Ra, 4083)),
        too_long(4083, 4082)
    );
    assert!(judp::encode(&frame(Version::As5669, 4082)).is_ok());
    assert_eq!(
        judp::encode(&frame(Version::Ra, 1)),
        Err(EncodeError::NoMessageCode { length: 1 })
    );
    // 65 507 octets of a UDP datagram over IPv4, less version and header.
    let longest = frame(Version::As5669a, judp::MAX_PAYLOAD);
    assert_eq!(judp::encode(&longest).unwrap().len(), 65_507);
    let mut out = BytesMut::new();
    assert!(as5669a::emit(&frame(Version::As5669a, 65_522), &mut out).is_err() && out.is_empty());
}

pub(super) fn any_frame(version: Version) -> impl Strategy<Value = Frame> {
    let shortest = if version == Version::As5669a { 0 } else { 2 };
    let ids =
        (any::<u32>(), any::<u32>()).prop_map(|(a, b)| (JausId::from_u32(a), JausId::from_u32(b)));
    (
        ids,
        any::<u8>(),
        any::<u16>(),
        proptest::collection::vec(any::<u8>(), shortest..300),
    )
        .prop_map(move |((source, destination), flags, sequence, payload)| {
            let frame = Frame::new(source, destination, payload.into());
            let scope = if destination.has_wildcard() {
                Broadcast::Global
            } else {
                Broadcast::None
            };
            // In the older headers, only the destination shows the scope.
            let flags = match version {
                Version::As5669a => Flags(flags),
                Version::As5669 | Version::Ra => Flags(flags).with_broadcast(scope),
            };
            Frame {
                version,
                flags,
                sequence,
                ..frame
            }
        })
}

fn any_version() -> impl Strategy<Value = Version> {
    prop_oneof![
        Just(Version::As5669a),
        Just(Version::As5669),
        Just(Version::Ra)
    ]
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(frame in any_version().prop_flat_map(any_frame)) {
        let datagram = judp::encode(&frame).unwrap();
        let read: Vec<_> = judp::frames(datagram).unwrap().collect();
        prop_assert_eq!(read, [Ok(frame)]);
    }

    #[test]
    fn what_is_read_from_any_octets_is_written_to_the_same(
        start in prop_oneof![Just(vec![2]), Just(b"JAUS01.0".to_vec()), Just(vec![1]), Just(vec![])],
        head in proptest::collection::vec(prop_oneof![Just(0_u8), Just(16), any::<u8>()], 0..20),
        rest in proptest::collection::vec(any::<u8>(), 0..60),
    ) {
        let datagram = Bytes::from([start, head, rest].concat());
        let Ok(mut frames) = judp::frames(datagram.clone()) else { return Ok(()) };
        let begin = frames.offset();
        if let Some(Ok(frame)) = frames.next()
            && frame.version == Version::As5669a
            && frame.kind == Kind(0)
        {
            let mut out = BytesMut::new();
            as5669a::emit(&frame, &mut out).unwrap();
            prop_assert_eq!(&out[..], &datagram[begin..frames.offset()]);
        }
        prop_assert!(frames.by_ref().count() <= 8);
        prop_assert!(frames.offset() + frames.remaining() == datagram.len());
    }
}
