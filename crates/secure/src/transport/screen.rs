//! Screens JUDP datagrams frame by frame: which frames may pass between a peer and this node.

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::rights::{Table, Unaccepted, check_unrecorded};
use jaus::wire::{Frame, judp};

use crate::trust::Peer;

/// The octets of a datagram that pass, and each frame with the decision on it.
#[derive(Debug)]
pub(super) struct Screened {
    /// The datagram as it was if all frames pass; without the others if some do; `None` if none.
    pub(super) passed: Option<Bytes>,
    pub(super) frames: Vec<(Frame, Result<(), Unaccepted>)>,
}

/// Screens a datagram from a peer; `None` if it is no JUDP. What changes something is refused if it cannot
/// be recorded.
pub(super) fn incoming(
    peer: &Peer,
    (table, can_record): (&Table, bool),
    octets: &Bytes,
) -> Option<Screened> {
    screen(octets, |frame| {
        if !peer.speaks_for(frame.source) {
            return Err(Unaccepted::Source);
        }
        let checked = peer.rules.check(frame, table);
        let checked = checked.and_then(|()| match can_record {
            true => Ok(()),
            false => check_unrecorded(frame, table),
        });
        checked.map_err(Unaccepted::Rule)
    })
}

/// Screens a datagram with this check; `None` if it is no JUDP.
pub(super) fn screen(
    octets: &Bytes,
    check: impl Fn(&Frame) -> Result<(), Unaccepted>,
) -> Option<Screened> {
    let mut following = judp::frames(octets.clone()).ok()?;
    let first = octets.len() - following.remaining();
    let (mut begin, mut kept, mut frames) = (first, Vec::new(), Vec::new());
    // The endpoint stops at the same frame: the first that is malformed.
    while let Some(Ok(frame)) = following.next() {
        let end = octets.len() - following.remaining();
        let decision = check(&frame);
        if decision.is_ok() {
            kept.push(begin..end);
        }
        frames.push((frame, decision));
        begin = end;
    }
    let passed = if kept.len() == frames.len() {
        Some(octets.clone())
    } else if kept.is_empty() {
        None
    } else {
        let mut passed = BytesMut::with_capacity(octets.len());
        passed.put_slice(&octets[..first]);
        for range in kept {
            passed.put_slice(&octets[range]);
        }
        Some(passed.freeze())
    };
    Some(Screened { passed, frames })
}

/// Whether a path between two peers is open: neither may be closed to the other.
pub(super) fn may_pass(source: JausId, origins: &[&Peer], to: &Peer) -> bool {
    let is_open = |origin: &&Peer| origin.rules.may_reach_any(&to.ids);
    to.rules.may_reach(source) && (origins.is_empty() || origins.iter().any(is_open))
}
