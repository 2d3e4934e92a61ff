//! Screens JUDP datagrams frame by frame: which frames may pass between a peer and this node.

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::wire::{Frame, judp};

use crate::trust::Peer;

/// What of a datagram passes: all octets if all frames pass, those of the others if some do, none if
/// no frame does; `None` if it is no JUDP. The check says whether a frame passes as it is.
pub(super) fn screen(
    octets: &Bytes,
    mut check: impl FnMut(&Frame) -> bool,
) -> Option<Option<Bytes>> {
    let mut following = judp::frames(octets.clone()).ok()?;
    let first = octets.len() - following.remaining();
    let (mut begin, mut kept, mut frames) = (first, Vec::new(), 0);
    // The endpoint stops at the same frame: the first that is malformed.
    while let Some(Ok(frame)) = following.next() {
        let end = octets.len() - following.remaining();
        if check(&frame) {
            kept.push(begin..end);
        }
        frames += 1;
        begin = end;
    }
    if kept.len() == frames {
        return Some(Some(octets.clone()));
    }
    if kept.is_empty() {
        return Some(None);
    }
    let mut passed = BytesMut::with_capacity(octets.len());
    passed.put_slice(&octets[..first]);
    for range in kept {
        passed.put_slice(&octets[range]);
    }
    Some(Some(passed.freeze()))
}

/// Whether a path between two peers is open: neither may be closed to the other.
pub(super) fn may_pass(source: JausId, origins: &[&Peer], to: &Peer) -> bool {
    let is_open = |origin: &&Peer| origin.rules.may_reach_any(&to.ids);
    to.rules.may_reach(source) && (origins.is_empty() || origins.iter().any(is_open))
}
