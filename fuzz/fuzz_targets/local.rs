//! The local link: streams of records, as a node reads them from a component and the other way
//! round, in pieces.
//!
//! The first octet chooses the side, the second the length of the pieces; the rest is the stream.
#![no_main]

use bytes::Bytes;
use jaus::link::local::record::{RecordError, Reply, Request};
use jaus::link::local::{Assembler, Body};
use libfuzzer_sys::fuzz_target;

/// Longer than the inputs, so that records may well announce more than ever comes.
const LIMIT: usize = 1 << 24;
/// More than ever is kept of small records, and of what a large one has announced but not brought.
const KEPT: usize = 512 << 10;

fuzz_target!(|octets: &[u8]| {
    let Some((&[side, piece], stream)) = octets.split_first_chunk() else {
        return;
    };
    let piece = 1 + usize::from(piece) * 8;
    if side % 2 == 0 {
        read(stream, piece, |body| {
            let request = Request::decode(body)?;
            comes_back(&request, Request::decode, |request, to| {
                request.encode_head(to).cloned()
            });
            Ok(())
        });
    } else {
        read(stream, piece, |body| {
            let reply = Reply::decode(body)?;
            comes_back(&reply, Reply::decode, |reply, to| {
                reply.encode_head(to).cloned()
            });
            Ok(())
        });
    }
});

/// Reads a stream in pieces, as a connection does.
fn read(stream: &[u8], piece: usize, mut each: impl FnMut(&Body<'_>) -> Result<(), RecordError>) {
    let mut assembler = Assembler::new(LIMIT);
    for mut octets in stream.chunks(piece) {
        while !octets.is_empty() {
            let taken = match assembler.room() {
                Some((buffer, room)) => {
                    assert!(buffer.capacity() <= KEPT + 2 * stream.len());
                    let now = octets.len().min(room);
                    buffer.extend_from_slice(&octets[..now]);
                    let result = assembler.filled().map_or(Ok(()), |body| each(&body));
                    result.map(|()| now)
                }
                None => {
                    let chunk = [assembler.begun(), octets].concat();
                    let result = assembler.take(&chunk, |body| each(&body));
                    assert!(assembler.begun().len() <= KEPT);
                    result.map(|()| octets.len())
                }
            };
            match taken {
                Ok(taken) => octets = &octets[taken..],
                // Nothing more is read from such a stream.
                Err(_) => return,
            }
        }
    }
}

/// What was understood is understood the same when it is written again. (Its octets may differ:
/// names are cut, and what is no text in them is replaced.)
fn comes_back<T: PartialEq + std::fmt::Debug>(
    record: &T,
    decode: impl Fn(&Body<'_>) -> Result<T, RecordError>,
    encode: impl Fn(&T, &mut Vec<u8>) -> Option<Bytes>,
) {
    let mut octets = Vec::new();
    if let Some(payload) = encode(record, &mut octets) {
        octets.extend_from_slice(&payload);
    }
    let (head, body) = octets.split_first_chunk::<4>().expect("a length");
    assert_eq!(u32::from_le_bytes(*head) as usize, body.len());
    assert_eq!(decode(&Body::Small(body)).as_ref(), Ok(record));
}
