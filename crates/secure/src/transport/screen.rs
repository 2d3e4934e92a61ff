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
    /// Frames that pass to a part of the ids that they are for: a datagram for each.
    pub(super) narrowed: Vec<Bytes>,
    pub(super) frames: Vec<(Frame, Result<(), Unaccepted>)>,
}

/// Screens a datagram from a peer; `None` if it is no JUDP. What changes something is refused if it cannot
/// be recorded.
pub(super) fn incoming(
    peer: &Peer,
    (table, can_record): (&Table, bool),
    octets: &Bytes,
) -> Option<Screened> {
    let mut narrowed = Vec::new();
    let mut screened = screen(octets, |frame| {
        if !peer.speaks_for(frame.source) {
            return Err(Unaccepted::Source);
        }
        let admitted = peer.rules.admit(frame, table).map_err(Unaccepted::Rule)?;
        if !can_record {
            check_unrecorded(frame, table).map_err(Unaccepted::Rule)?;
        }
        let copies = admitted.copies(frame);
        let passes_whole = copies.is_none();
        narrowed.extend(copies.into_iter().flatten());
        Ok(passes_whole)
    })?;
    let datagrams = narrowed.iter().filter_map(|copy| judp::encode(copy).ok());
    screened.narrowed = datagrams.collect();
    Some(screened)
}

/// Screens a datagram with this check, which says whether a frame passes as it is; `None` if it is no JUDP.
pub(super) fn screen(
    octets: &Bytes,
    mut check: impl FnMut(&Frame) -> Result<bool, Unaccepted>,
) -> Option<Screened> {
    let mut following = judp::frames(octets.clone()).ok()?;
    let first = octets.len() - following.remaining();
    let (mut begin, mut kept, mut frames) = (first, Vec::new(), Vec::new());
    // The endpoint stops at the same frame: the first that is malformed.
    while let Some(Ok(frame)) = following.next() {
        let end = octets.len() - following.remaining();
        let decision = check(&frame);
        if decision == Ok(true) {
            kept.push(begin..end);
        }
        frames.push((frame, decision.map(drop)));
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
    let narrowed = Vec::new();
    Some(Screened {
        passed,
        narrowed,
        frames,
    })
}

/// Whether a path between two peers is open: neither may be closed to the other.
pub(super) fn may_pass(source: JausId, origins: &[&Peer], to: &Peer) -> bool {
    let is_open = |origin: &&Peer| origin.rules.may_reach_any(&to.ids);
    to.rules.may_reach(source) && (origins.is_empty() || origins.iter().any(is_open))
}
