//! Recognises the TCP connections that carry JTCP, on any port.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};

use jaus::wire::jtcp::Decoder;
use jaus::wire::judp::VERSION_AS5669A;
use jaus_limits::{first_of_largest, quota_address};

use crate::packets::Packet;

/// Limit of connections. Beyond it one is forgotten: of the network address that has opened the most,
/// the one that has been idle for longest.
const MOST: usize = 256;
/// Limit of packets of a connection that wait until it is recognised.
const MOST_HELD: usize = 8;

/// The connections so far, the one that was used last at the end.
#[derive(Default)]
pub(super) struct Connections(VecDeque<Connection>);

struct Connection {
    /// Its ends in order, because both directions belong together.
    ends: [SocketAddr; 2],
    /// The network address that sent its first packet.
    opened_by: IpAddr,
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
        let (opened_by, mut state) = match known {
            Some(known) if !segment.opens => (known.opened_by, known.state),
            _ => {
                let opened_by = quota_address(segment.ends[0].ip());
                (opened_by, State::Unknown(Vec::new()))
            }
        };
        let recorded = state.advance(segment.octets, packet);
        if self.0.len() == MOST {
            let place = first_of_largest(&self.0, |it| it.opened_by);
            place.and_then(|place| self.0.remove(place));
        }
        self.0.push_back(Connection {
            ends,
            opened_by,
            state,
        });
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

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jaus::address::JausId;
    use jaus::wire::{Frame, jtcp};
    use jaus_view::Timestamp;

    use super::*;

    #[test]
    fn a_flood_of_connections_does_not_forget_those_of_another_address() {
        let mut connections = Connections::default();
        let packet = |octets: &[u8]| Packet {
            interface: "eth0".to_owned(),
            time: Timestamp::new(1_790_000_000, 0, 9),
            octets: Bytes::copy_from_slice(octets),
        };
        let mut pass = |source: &str, opens, octets: &[u8]| {
            let ends = [source, "10.0.0.2:3794"].map(|it| it.parse().unwrap());
            let segment = Segment {
                ends,
                opens,
                octets,
            };
            connections.recognise(&segment, &packet(octets))
        };
        assert!(pass("10.0.0.1:4000", true, b"").is_none());
        for port in 1..=1000 {
            pass(&format!("10.0.0.66:{port}"), true, b"GET /");
        }
        let payload = Bytes::from_static(&[0x00, 0x2B, 0x02]);
        let frame = Frame::new(JausId::new(101, 1, 1), JausId::new(102, 1, 1), payload);
        let message = jtcp::encode(&frame).unwrap();
        let earlier = pass("10.0.0.1:4000", false, &message).unwrap();
        assert_eq!(earlier.len(), 1, "with the packet that opened it");
    }
}
