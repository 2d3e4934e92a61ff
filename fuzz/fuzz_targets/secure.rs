//! The secure link, from where its input is not authenticated yet and from where a trusted peer
//! turns hostile: beacons, the datagrams in a stream, and the check that a peer speaks only for its
//! own ids.
//!
//! The first octet is the length of the pieces in which the stream arrives; the rest is a beacon, a
//! stream and a datagram at once.
#![no_main]

use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::codec::Message as _;
use jaus::messages::mobility::SetTravelSpeed;
use jaus::rights::Table;
use jaus::wire::{DataControl, judp};
use jaus_secure::beacon::{Counter, LENGTH, Neighbors, Received};
use jaus_secure::transport::{Inlet, framed};
use jaus_secure::{Peer, PublicKey, Trust, TrustFile};
use libfuzzer_sys::fuzz_target;

/// The longest datagram in a stream, with its prefix.
const LONGEST: usize = 2 + 65_535;

/// A trusted peer, of whose private key nobody knows.
static PEER: LazyLock<Peer> = LazyLock::new(|| {
    let key = PublicKey::from_octets([7; 32]);
    let trust = Trust::parse(&format!(
        "rover {key} 101.255.255,102.1.255 control=127 with=60.255.255 except=SetTravelSpeed"
    ));
    let trust = trust.expect("a trust file");
    trust.find(key).expect("it is in it").clone()
});

fuzz_target!(|input: &[u8]| {
    let Some((&piece, octets)) = input.split_first() else {
        return;
    };
    beacon(octets);
    stream(octets, usize::from(piece).max(1));
    datagram(octets);
});

/// A decoded beacon encodes to the same octets, and no beacon is accepted without a signature.
fn beacon(octets: &[u8]) {
    let key = PEER.key;
    let trust = TrustFile::of(Trust::new(vec![PEER.clone()]));
    let mut neighbors = Neighbors::new(PublicKey::from_octets([8; 32]), trust);
    let from = SocketAddr::from(([10, 0, 0, 1], 3796));
    let now = Instant::now();
    assert_eq!(neighbors.handle(now, from, octets), None);
    let later = now + Duration::from_secs(60);
    assert_eq!(neighbors.handle(later, from, octets), None);
    let Some(received) = Received::decode(octets) else {
        assert_eq!(neighbors.counters().get(Counter::Malformed), 2);
        return;
    };
    assert_eq!(octets.len(), LENGTH);
    assert_eq!(received.verify(key), None);
    let claim = received.claim();
    let signed = claim.encode();
    let again = [&signed[..], &octets[signed.len()..]].concat();
    assert_eq!(Received::decode(&again).map(|it| *it.claim()), Some(*claim));
}

/// The datagrams of a stream do not depend on how it is cut, and lead to the same stream again.
fn stream(octets: &[u8], piece: usize) {
    let (whole, pieces) = (datagrams(octets, octets.len()), datagrams(octets, piece));
    assert_eq!(whole, pieces);
    let again: Vec<u8> = whole
        .iter()
        .flat_map(|datagram| framed(datagram).expect("it came with a prefix"))
        .collect();
    assert!(octets.starts_with(&again));
    assert!(octets.len() - again.len() < LONGEST);
}

fn datagrams(octets: &[u8], piece: usize) -> Vec<Bytes> {
    let mut inlet = Inlet::default();
    let mut found = Vec::new();
    for piece in octets.chunks(piece.max(1)) {
        inlet.push(piece);
        found.extend(std::iter::from_fn(|| inlet.next()));
    }
    found
}

/// A peer speaks for the sources of its own nodes and for no others, wildcards included; and what its
/// rules allow is neither for others than they name, nor excluded.
fn datagram(octets: &[u8]) {
    let Ok(frames) = judp::frames(Bytes::copy_from_slice(octets)) else {
        return;
    };
    for frame in frames.flatten() {
        let source = frame.source;
        let is_component = !matches!(source.component(), 0 | 255);
        let is_own = match (source.subsystem(), source.node()) {
            (101, node) => !matches!(node, 0 | 255),
            node => node == (102, 1),
        };
        assert_eq!(PEER.speaks_for(source), is_component && is_own, "{source}");
        if PEER.rules.check(&frame, &Table::default()).is_ok() {
            assert!(
                matches!(frame.destination.subsystem(), 60 | 65535),
                "{frame:?}"
            );
            let is_whole = frame.flags.data() == DataControl::Single && !frame.is_acknowledgement();
            assert!(
                !is_whole || frame.code() != Some(SetTravelSpeed::CODE),
                "{frame:?}"
            );
        }
    }
}
