//! Records of the local protocol: any content, in any segmentation.

use std::net::{Ipv6Addr, SocketAddr, SocketAddrV6};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, Path, Remote, SessionId, Shortfall, Unacknowledged};
use jaus::link::local::Assembler;
use jaus::link::local::record::{Head, Outcome, Reason, Record, RecordError, VERSION};
use jaus::wire::Flags;
use proptest::collection::vec;
use proptest::prelude::*;

/// The assemblers here refuse longer records.
const LIMIT: usize = 300_000;

fn id() -> impl Strategy<Value = JausId> {
    any::<u32>().prop_map(JausId::from_u32)
}

fn flags() -> impl Strategy<Value = Flags> {
    let known = |flags: &Flags| flags.broadcast().is_some();
    any::<u8>().prop_map(Flags).prop_filter("a scope", known)
}

/// Mostly short, sometimes long enough for a separate buffer.
fn payload() -> impl Strategy<Value = Bytes> {
    let length = prop_oneof![8 => 0..100_usize, 2 => 4000..4200_usize, 1 => 8000..LIMIT - 100];
    (length, any::<u8>()).prop_map(|(length, octet)| vec![octet; length].into())
}

fn path() -> impl Strategy<Value = Option<Path>> {
    let v4 = any::<([u8; 4], u16)>().prop_map(|place| SocketAddr::from(place).into());
    let v6 = any::<([u8; 16], u16, u32)>().prop_map(|(ip, port, scope)| {
        let address = SocketAddrV6::new(Ipv6Addr::from(ip), port, 0, scope);
        Remote::Socket(address.into())
    });
    let session = any::<u64>().prop_map(|number| Remote::Session(SessionId(number)));
    let peer = prop_oneof![Just(Remote::Line), session, v4, v6];
    let path = (any::<u16>().prop_map(LinkId), peer);
    prop::option::of(path.prop_map(|(link, peer)| Path { link, peer }))
}

fn outcome() -> impl Strategy<Value = Outcome> {
    let reason = prop::sample::select(vec![
        Unacknowledged::Refused,
        Unacknowledged::TimedOut,
        Unacknowledged::NotSent,
    ]);
    let not = (reason, id(), any::<(u32, u32)>()).prop_map(
        |(reason, destination, (acknowledged, length))| {
            Outcome::NotAcknowledged(Shortfall {
                reason,
                destination,
                acknowledged,
                length,
            })
        },
    );
    prop_oneof![Just(Outcome::Acknowledged), not, Just(Outcome::Rejected)]
}

fn head() -> impl Strategy<Value = Head> {
    let version = VERSION;
    prop_oneof![
        1 => id().prop_map(move |id| Head::Hello { version, id }),
        1 => any::<u8>().prop_filter("another version", |&it| it != VERSION).prop_map(|version| {
            Head::Hello { version, id: JausId::from_u32(0) }
        }),
        8 => (flags(), any::<u64>(), id()).prop_map(|(flags, handle, destination)| Head::Send {
            flags,
            handle,
            destination,
        }),
        1 => Just(Head::Leave),
        1 => (id(), any::<u32>()).prop_map(|(id, max_message)| Head::Welcome { id, max_message }),
        1 => Just(Head::Refused(Reason::Taken)),
        1 => any::<u64>().prop_map(|handle| Head::Cancel { handle }),
        8 => (flags(), id(), id(), any::<u16>(), path()).prop_map(
            |(flags, source, destination, sequence, path)| Head::Deliver {
                flags,
                source,
                destination,
                sequence,
                path,
            }
        ),
        1 => id().prop_map(|source| Head::Progress { source }),
        4 => (any::<u64>(), outcome())
            .prop_map(|(handle, outcome)| Head::Outcome { handle, outcome }),
    ]
}

fn record() -> impl Strategy<Value = Record> {
    (head(), payload()).prop_map(|(head, payload)| Record { head, payload })
}

/// The octets of records, in sequence.
fn written(records: &[Record]) -> Vec<u8> {
    let mut octets = Vec::new();
    for record in records {
        record.encode_head(&mut octets);
        octets.extend_from_slice(&record.payload);
    }
    octets
}

/// Reads octets in pieces of these lengths.
fn read(mut octets: &[u8], pieces: &[usize]) -> Result<Vec<Record>, RecordError> {
    let (mut assembler, mut records) = (Assembler::new(LIMIT), Vec::new());
    let mut pieces = pieces.iter().cycle();
    while !octets.is_empty() {
        let (piece, rest) = octets.split_at(octets.len().min(*pieces.next().unwrap()));
        assembler.room().extend_from_slice(piece);
        while let Some(record) = assembler.next_record()? {
            records.push(record);
        }
        octets = rest;
    }
    Ok(records)
}

/// Replaces an IPv4 address in IPv6 form by the IPv4 address, without scope.
fn canonical(mut records: Vec<Record>) -> Vec<Record> {
    for record in &mut records {
        if let Head::Deliver {
            path: Some(path), ..
        } = &mut record.head
            && let Remote::Socket(address) = path.peer
            && address.ip() != address.ip().to_canonical()
        {
            path.peer = SocketAddr::new(address.ip().to_canonical(), address.port()).into();
        }
    }
    records
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn records_come_out_as_they_went_in(
        records in vec(record(), 0..20),
        pieces in vec(1..20_000_usize, 1..10),
    ) {
        let octets = written(&records);
        prop_assert_eq!(read(&octets, &pieces), Ok(canonical(records)));
    }

    #[test]
    fn small_pieces_make_no_difference(records in vec(record(), 1..4), piece in 1..7_usize) {
        let octets = written(&records);
        let octets = &octets[..octets.len().min(30_000)];
        prop_assert_eq!(read(octets, &[piece]), read(octets, &[usize::MAX]));
    }

    #[test]
    fn what_is_understood_is_understood_the_same_when_it_is_written_again(
        octets in vec(any::<u8>(), 0..60),
    ) {
        if let Ok(record) = Record::decode(octets.into()) {
            let again = written(std::slice::from_ref(&record));
            prop_assert_eq!(read(&again, &[usize::MAX]), Ok(vec![record]));
        }
    }
}

#[test]
fn a_record_that_is_too_long_ends_the_stream_before_anything_is_kept_for_it() {
    let mut assembler = Assembler::new(100);
    assembler.room().extend_from_slice(&[101, 0, 0, 0, 2]);
    let (length, limit) = (101, 100);
    let expected = Err(RecordError::TooLong { length, limit });
    assert_eq!(assembler.next_record(), expected);
}

#[test]
fn a_long_record_that_does_not_come_takes_no_more_room_than_a_few_that_come() {
    let mut assembler = Assembler::new(usize::MAX);
    let begun = [&u32::MAX.to_le_bytes()[..], &[2; 1000]].concat();
    assembler.room().extend_from_slice(&begun);
    assert_eq!(assembler.next_record(), Ok(None));
    let capacity = assembler.room().capacity();
    assert!((1..=2 << 20).contains(&capacity), "{capacity}");
}

#[test]
fn a_first_record_of_another_protocol_cannot_be_read() {
    let malformed = |octets: &'static [u8]| {
        let (kind, length) = (octets[0], octets.len());
        let expected = Err(RecordError::Malformed { kind, length });
        assert_eq!(Record::decode(Bytes::from_static(octets)), expected);
    };
    malformed(b"\x01GET / HTTP/1.1");
    malformed(&[99]);
    malformed(&[2, 0, 0]);
}

#[test]
fn text_is_cut_at_a_whole_character_and_shown_without_control_characters() {
    let long = "à".repeat(200);
    let hello = Record::with_text(Head::hello(JausId::from_u32(0)), &long);
    assert_eq!(hello.text(), "à".repeat(127));
    let hello = Record::with_text(Head::hello(JausId::from_u32(0)), "a\u{1b}[2Jb");
    assert_eq!(hello.text(), r"a\u{1b}[2Jb");
}
