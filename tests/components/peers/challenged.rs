//! Acknowledges challenges as a peer's transport does; recordings cannot do that.

use bytes::Bytes;
use jaus::endpoint::{Path, To, Transmit};
use jaus::wire::{Acknowledgement, Broadcast, Flags, Frame, judp};

/// Query Heartbeat Pulse.
const CHALLENGE: &[u8] = b"\x02\x22";

/// The acknowledgement of a challenge to one peer: its path and its datagram. `None` for other
/// datagrams.
pub(crate) fn acknowledgement(transmit: &Transmit) -> Option<(Path, Bytes)> {
    let To::Peer(peer) = transmit.to else {
        return None;
    };
    let query = judp::frames(transmit.payload.clone()).ok()?.next()?.ok()?;
    let is_challenge = query.payload == CHALLENGE
        && query.flags.acknowledgement() == Acknowledgement::Request
        && query.flags.broadcast() == Some(Broadcast::None);
    let answer = Frame {
        version: query.version,
        flags: Flags::default().with_acknowledgement(Acknowledgement::Positive),
        sequence: query.sequence,
        ..Frame::new(query.destination, query.source, Bytes::new())
    };
    let link = transmit.link;
    is_challenge.then(|| (Path { link, peer }, judp::encode(&answer).unwrap()))
}
