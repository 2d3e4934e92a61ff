//! Screens JUDP datagrams frame by frame: which frames may pass between a peer and this node.

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages;
use jaus::messages::core::{ClearEmergency, ConfirmControl, confirm_control::ResponseCode};
use jaus::wire::{Frame, judp};

use crate::rules::{Refusal, clears_all};
use crate::trust::Peer;

/// Why a frame does not pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The key may not speak for its source.
    ForeignId,
    /// A rule of the key forbids it.
    Rule(Refusal),
}

/// The octets of a datagram that pass, and each frame with the decision on it.
#[derive(Debug)]
pub(super) struct Screened {
    /// The datagram as it was if all frames pass; without the others if some do; `None` if none.
    pub(super) passed: Option<Bytes>,
    pub(super) frames: Vec<(Frame, Result<(), Stop>)>,
}

/// Screens a datagram from a peer; `None` if it is no JUDP.
pub(super) fn incoming(peer: &Peer, octets: &Bytes) -> Option<Screened> {
    screen(octets, |frame| {
        if !peer.speaks_for(frame.source) {
            return Err(Stop::ForeignId);
        }
        peer.rules.check(frame).map_err(Stop::Rule)
    })
}

/// Screens a datagram with this check; `None` if it is no JUDP.
pub(super) fn screen(
    octets: &Bytes,
    check: impl Fn(&Frame) -> Result<(), Stop>,
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

/// What Confirm Control says, if the frame is one.
pub(super) fn confirmed_control(frame: &Frame) -> Option<ResponseCode> {
    let is_answer = frame.code() == Some(ConfirmControl::CODE);
    let decoded = is_answer.then(|| ConfirmControl::decode(&frame.payload).ok());
    decoded.flatten().map(|it| it.response_code)
}

/// The name of a message, or its code, for people.
pub(super) fn name_of(frame: &Frame) -> String {
    let Some(code) = frame.code() else {
        return "a message".to_owned();
    };
    let known = messages::registry().by_code(code).next();
    let name = known.map_or_else(|| format!("{code:04X}h"), |message| message.name.to_owned());
    match code == ClearEmergency::CODE && clears_all(&frame.payload) {
        true => format!("{name} of all clients"),
        false => name,
    }
}

/// One frame of a message that was refused, in words for the peer and the log.
pub(super) fn sentence(frame: &Frame, refusal: Refusal) -> String {
    let Frame {
        source,
        destination,
        ..
    } = frame;
    let name = name_of(frame);
    format!("{name} from {source} to {destination}: {refusal}")
}

/// Whether a path between two peers is open: neither may be closed to the other.
pub(super) fn may_pass(source: JausId, origins: &[&Peer], to: &Peer) -> bool {
    let is_open = |origin: &&Peer| origin.rules.may_reach_any(&to.ids);
    to.rules.may_reach(source) && (origins.is_empty() || origins.iter().any(is_open))
}
