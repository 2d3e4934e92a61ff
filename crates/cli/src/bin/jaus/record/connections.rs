//! Recognises the TCP connections that carry JTCP, on any port.

use std::collections::VecDeque;
use std::net::SocketAddr;

use jaus::wire::jtcp::Decoder;
use jaus::wire::judp::VERSION_AS5669A;

use crate::packets::Packet;

/// Limit of connections. Beyond it the one that has been idle for longest is forgotten.
const MOST: usize = 256;
/// Limit of packets of a connection that wait until it is recognised.
const MOST_HELD: usize = 8;

/// The connections so far, the one that was used last at the end.
#[derive(Default)]
pub(super) struct Connections(VecDeque<Connection>);

struct Connection {
    /// Its ends in order, because both directions belong together.
    ends: [SocketAddr; 2],
    state: State,
}

enum State {
    /// No message has begun a segment so far. Readers need the packets that open a connection.
    Unknown(Vec<Packet>),
    Jaus,
}

/// A TCP segment.
pub(super) struct Segment<'a> {
    pub(super) ends: [SocketAddr; 2],
    /// Whether it opens a connection.
    pub(super) opens: bool,
    pub(super) octets: &'a [u8],
}

impl Connections {
    /// Whether the segment's connection carries JTCP; then with its earlier packets, once.
    pub(super) fn recognise(
        &mut self,
        segment: &Segment<'_>,
        packet: &Packet,
    ) -> Option<Vec<Packet>> {
        let mut ends = segment.ends;
        ends.sort_unstable();
        let place = self.0.iter().position(|it| it.ends == ends);
        let known = place.and_then(|place| self.0.remove(place));
        let mut state = match known {
            Some(known) if !segment.opens => known.state,
            _ => State::Unknown(Vec::new()),
        };
        let recorded = state.advance(segment.octets, packet);
        if self.0.len() == MOST {
            self.0.pop_front();
        }
        self.0.push_back(Connection { ends, state });
        recorded
    }
}

impl State {
    fn advance(&mut self, octets: &[u8], packet: &Packet) -> Option<Vec<Packet>> {
        match self {
            Self::Jaus => Some(Vec::new()),
            Self::Unknown(held) if begins_with_message(octets) => {
                let held = std::mem::take(held);
                *self = Self::Jaus;
                Some(held)
            }
            Self::Unknown(held) => {
                if held.len() < MOST_HELD {
                    held.push(packet.clone());
                }
                None
            }
        }
    }
}

/// Whether octets of a stream are the beginning of one, with its version, or the beginning of a
/// message.
fn begins_with_message(octets: &[u8]) -> bool {
    [&[][..], &[VERSION_AS5669A]].into_iter().any(|version| {
        let mut decoder = Decoder::new();
        decoder.input().extend_from_slice(version);
        decoder.input().extend_from_slice(octets);
        matches!(decoder.next_frame(), Ok(Some(frame)) if frame.is_plausible())
    })
}
