//! The local link: streams of records in pieces, as node and component read them.
//!
//! The first octet is the length of the pieces; the rest is the stream.
#![no_main]

use jaus::link::local::Assembler;
use jaus::link::local::record::{Record, RecordError};
use libfuzzer_sys::fuzz_target;

/// Longer than the inputs, so that records may announce more than ever arrives.
const LIMIT: usize = 1 << 20;

fuzz_target!(|octets: &[u8]| {
    if let Some((&piece, stream)) = octets.split_first() {
        // After an error, nothing more is read from a stream.
        let _ = read(stream, 1 + usize::from(piece) * 8);
    }
});

/// Reads a stream in pieces, as a connection does.
fn read(mut stream: &[u8], piece: usize) -> Result<(), RecordError> {
    let mut assembler = Assembler::new(LIMIT);
    while !stream.is_empty() {
        let (now, rest) = stream.split_at(stream.len().min(piece));
        let room = assembler.room();
        assert!(room.capacity() > room.len() && room.len() < LIMIT);
        room.extend_from_slice(now);
        while let Some(record) = assembler.next_record()? {
            comes_back(&record);
        }
        stream = rest;
    }
    Ok(())
}

/// A decoded record encodes to octets that decode to the same record. (The octets may differ: a
/// path's address may be written in two ways.)
fn comes_back(record: &Record) {
    let mut octets = Vec::new();
    record.encode_head(&mut octets);
    octets.extend_from_slice(&record.payload);
    let (length, body) = octets.split_first_chunk().expect("a length");
    assert_eq!(u32::from_le_bytes(*length) as usize, body.len());
    assert_eq!(Record::decode(body.to_vec().into()).as_ref(), Ok(record));
}
