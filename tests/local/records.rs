//! The protocol's octets: whatever comes in whatever pieces.

use std::net::{Ipv6Addr, SocketAddr, SocketAddrV6};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, Path, Remote, Unacknowledged};
use jaus::link::local::record::{
    Delivery, Hello, Reason, RecordError, Refusal, Reply, Request, Send, Want, Welcome,
};
use jaus::link::local::{Assembler, Body};
use jaus::wire::{Broadcast, Priority};
use proptest::collection::vec;
use proptest::prelude::*;

/// What the assemblers here take for too long.
const LIMIT: usize = 300_000;

fn id() -> impl Strategy<Value = JausId> {
    any::<u32>().prop_map(JausId::from_u32)
}

fn priority() -> impl Strategy<Value = Priority> {
    prop::sample::select(Priority::ALL.to_vec())
}

fn broadcast() -> impl Strategy<Value = Broadcast> {
    prop::sample::select(vec![Broadcast::None, Broadcast::Local, Broadcast::Global])
}

/// Mostly short, sometimes long enough for a buffer of its own.
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
    let peer = prop_oneof![Just(Remote::Line), v4, v6];
    let path = (any::<u16>().prop_map(LinkId), peer);
    prop::option::of(path.prop_map(|(link, peer)| Path { link, peer }))
}

fn request() -> impl Strategy<Value = Request> {
    let want = prop_oneof![
        any::<u8>().prop_map(Want::Component),
        id().prop_map(Want::Id),
    ];
    let hello = (any::<u8>(), want, "[a-zà]{0,100}").prop_map(|(version, want, name)| {
        Request::Hello(Hello {
            version,
            want,
            name,
        })
    });
    let send = (
        any::<(u64, bool)>(),
        id(),
        priority(),
        broadcast(),
        payload(),
    )
        .prop_map(
            |((handle, acknowledge), destination, priority, broadcast, payload)| {
                Request::Send(Send {
                    handle,
                    destination,
                    priority,
                    broadcast,
                    acknowledge,
                    payload,
                })
            },
        );
    prop_oneof![1 => hello, 8 => send, 1 => Just(Request::Leave)]
}

fn reply() -> impl Strategy<Value = Reply> {
    let welcome = (id(), any::<u32>())
        .prop_map(|(id, max_message)| Reply::Welcome(Welcome { id, max_message }));
    let refused = "[a-zà]{0,100}".prop_map(|words| {
        let reason = Reason::Taken;
        Reply::Refused(Refusal { reason, words })
    });
    let deliver = (id(), id(), priority(), broadcast(), path(), payload()).prop_map(
        |(source, destination, priority, broadcast, path, payload)| {
            Reply::Deliver(Delivery {
                source,
                destination,
                priority,
                broadcast,
                path,
                payload,
            })
        },
    );
    let acknowledged =
        (any::<u64>(), id()).prop_map(|(handle, by)| Reply::Acknowledged { handle, by });
    let reason = prop::sample::select(vec![
        Unacknowledged::Refused,
        Unacknowledged::TimedOut,
        Unacknowledged::NotSent,
    ]);
    let not = (any::<(u64, u32, u32)>(), id(), reason).prop_map(
        |((handle, acknowledged, length), destination, reason)| Reply::NotAcknowledged {
            handle,
            destination,
            reason,
            acknowledged,
            length,
        },
    );
    let rejected = (any::<u64>(), "[a-zà]{0,100}")
        .prop_map(|(handle, words)| Reply::Rejected { handle, words });
    prop_oneof![1 => welcome, 1 => refused, 8 => deliver, 2 => acknowledged, 2 => not, 1 => rejected]
}

/// The octets of records, one after the other.
fn written<T>(records: &[T], head: impl Fn(&T, &mut Vec<u8>) -> Option<Bytes>) -> Vec<u8> {
    let mut octets = Vec::new();
    for record in records {
        if let Some(payload) = head(record, &mut octets) {
            octets.extend_from_slice(&payload);
        }
    }
    octets
}

/// What comes out of an assembler that gets the octets in pieces of these lengths, read as a
/// connection reads them: large records directly, all else after what has begun.
fn read<T>(
    mut octets: &[u8],
    pieces: &[usize],
    decode: impl Fn(&Body<'_>) -> Result<T, RecordError>,
) -> Result<Vec<T>, RecordError> {
    let (mut assembler, mut records) = (Assembler::new(LIMIT), Vec::new());
    let mut pieces = pieces.iter().cycle();
    while !octets.is_empty() {
        let mut piece = octets.len().min(*pieces.next().unwrap());
        if let Some((buffer, room)) = assembler.room() {
            piece = piece.min(room);
            buffer.extend_from_slice(&octets[..piece]);
            if let Some(body) = assembler.filled() {
                records.push(decode(&body)?);
            }
        } else {
            let mut chunk = assembler.begun().to_vec();
            assert!(chunk.len() <= 4100, "{} octets are kept", chunk.len());
            chunk.extend_from_slice(&octets[..piece]);
            assembler.take::<RecordError>(&chunk, |body| {
                records.push(decode(&body)?);
                Ok(())
            })?;
        }
        octets = &octets[piece..];
    }
    Ok(records)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn requests_come_out_as_they_went_in(
        requests in vec(request(), 0..20),
        pieces in vec(1..20_000_usize, 1..10),
    ) {
        let octets = written(&requests, |request, to| request.encode_head(to).cloned());
        prop_assert_eq!(read(&octets, &pieces, Request::decode), Ok(requests));
    }

    #[test]
    fn replies_come_out_as_they_went_in(
        replies in vec(reply(), 0..20),
        pieces in vec(1..20_000_usize, 1..10),
    ) {
        let octets = written(&replies, |reply, to| reply.encode_head(to).cloned());
        prop_assert_eq!(read(&octets, &pieces, Reply::decode), Ok(replies));
    }

    #[test]
    fn small_pieces_make_no_difference(replies in vec(reply(), 1..4), piece in 1..7_usize) {
        let octets = written(&replies, |reply, to| reply.encode_head(to).cloned());
        let octets = &octets[..octets.len().min(30_000)];
        let whole = read(octets, &[usize::MAX], Reply::decode);
        prop_assert_eq!(read(octets, &[piece], Reply::decode), whole);
    }

    #[test]
    fn what_is_understood_is_written_the_same_again(octets in vec(any::<u8>(), 0..60)) {
        if let Ok(request) = Request::decode(&Body::Small(&octets)) {
            let again = written(&[request], |request, to| request.encode_head(to).cloned());
            prop_assert_eq!(&again[4..], &octets[..]);
        }
    }
}

#[test]
fn a_record_that_is_too_long_ends_the_stream_before_anything_is_kept_for_it() {
    let mut assembler = Assembler::new(100);
    let result = assembler.take::<RecordError>(&[101, 0, 0, 0, 2], |_| Ok(()));
    let (length, limit) = (101, 100);
    assert_eq!(result, Err(RecordError::TooLong { length, limit }));
}

#[test]
fn a_long_record_that_does_not_come_takes_no_more_room_than_what_has_come() {
    let mut assembler = Assembler::new(usize::MAX);
    let head = [&u32::MAX.to_le_bytes()[..], &[2; 1000]].concat();
    assembler.take::<RecordError>(&head, |_| Ok(())).unwrap();
    let (buffer, _) = assembler.room().unwrap();
    assert!(buffer.capacity() <= 256 << 10, "{}", buffer.capacity());
}

#[test]
fn whoever_does_not_greet_is_a_stranger() {
    let greeting = Body::Small(b"\x01GET / HTTP/1.1");
    assert_eq!(Request::decode(&greeting), Err(RecordError::Stranger));
    assert_eq!(
        Request::decode(&Body::Small(&[99])),
        Err(RecordError::Kind(99))
    );
    let short = Request::decode(&Body::Small(&[2, 0, 0]));
    assert!(matches!(short, Err(RecordError::Length { kind: 2, .. })));
}
