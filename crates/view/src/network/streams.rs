//! Reassembly of TCP streams with bounded memory, and the JTCP messages in them.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};

use jaus::wire::Frame;
use jaus::wire::jtcp::Decoder;
use jaus::wire::judp::VERSION_AS5669A;
use jaus_limits::{first_of_largest, quota_address};

/// Limit of streams. Beyond it one is forgotten: of the sender with the most, the one that has been
/// idle for longest.
const MOST_STREAMS: usize = 256;
/// Limit of segments that wait for an earlier one. Beyond it that one counts as lost.
const MOST_WAITING: usize = 64;

/// A captured TCP segment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment<'a> {
    pub(super) source: SocketAddr,
    pub(super) destination: SocketAddr,
    pub(super) number: u32,
    /// Whether it begins the stream.
    pub(super) syn: bool,
    /// Whether the capture truncated it.
    pub(super) cut: bool,
    pub(super) octets: &'a [u8],
}

/// The directions of TCP connections, the one that was used last at the end.
#[derive(Debug, Default)]
pub(super) struct Streams {
    known: VecDeque<Stream>,
    gaps: u64,
    /// Segments of forgotten streams without a message.
    foreign: u64,
}

/// One direction of a connection.
#[derive(Debug)]
struct Stream {
    ends: [SocketAddr; 2],
    /// Sequence number of the next octet.
    next: u32,
    /// Segments after a gap: number and octets.
    waiting: Vec<(u32, Vec<u8>)>,
    decoder: Decoder,
    /// Whether it has held a plausible message.
    is_jaus: bool,
    segments: u64,
}

impl Streams {
    /// Number of places where octets are missing or unreadable.
    pub(super) fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Number of segments in streams that have not held a message so far.
    pub(super) fn foreign(&self) -> u64 {
        self.foreign + self.known.iter().map(Stream::foreign).sum::<u64>()
    }

    /// Adds a segment. Returns the messages that it completes.
    pub(super) fn insert(&mut self, segment: Segment<'_>) -> Vec<Frame> {
        let mut stream = self.take(&segment);
        let mut frames = Vec::new();
        if !segment.octets.is_empty() {
            stream.segments += 1;
            stream
                .waiting
                .push((segment.number, segment.octets.to_vec()));
            self.gaps += stream.read(&mut frames);
        }
        if segment.cut {
            stream.next = segment.number.wrapping_add(segment.octets.len() as u32);
            self.gaps += stream.begin_anew();
        }
        stream.is_jaus |= frames.iter().any(Frame::is_plausible);
        if !stream.is_jaus {
            frames.clear();
        }
        self.known.push_back(stream);
        frames
    }

    /// The segment's stream, taken out of the list.
    fn take(&mut self, segment: &Segment<'_>) -> Stream {
        let ends = [segment.source, segment.destination];
        let place = self.known.iter().position(|it| it.ends == ends);
        let known = place.and_then(|place| self.known.remove(place));
        let forgotten = match known {
            Some(stream) if !segment.syn => return stream,
            None if self.known.len() == MOST_STREAMS => {
                let place = first_of_largest(&self.known, Stream::sender);
                place.and_then(|place| self.known.remove(place))
            }
            known => known,
        };
        self.foreign += forgotten.as_ref().map_or(0, Stream::foreign);
        Stream {
            ends,
            next: segment.number.wrapping_add(u32::from(segment.syn)),
            waiting: Vec::new(),
            decoder: if segment.syn { Decoder::new() } else { amid() },
            is_jaus: false,
            segments: 0,
        }
    }
}

impl Stream {
    /// The network address that sends it.
    fn sender(&self) -> IpAddr {
        quota_address(self.ends[0].ip())
    }

    /// Number of its segments, unless it has held a message.
    fn foreign(&self) -> u64 {
        if self.is_jaus { 0 } else { self.segments }
    }

    /// Decodes what is in order. Returns the number of gaps.
    fn read(&mut self, frames: &mut Vec<Frame>) -> u64 {
        let mut gaps = 0;
        loop {
            gaps += self.read_in_order(frames);
            if self.waiting.len() <= MOST_WAITING {
                return gaps;
            }
            // What is missing was not captured. A message most often begins with a segment.
            let ahead = |number: u32| number.wrapping_sub(self.next);
            let first = self.waiting.iter().map(|(number, _)| *number);
            self.next = first.min_by_key(|it| ahead(*it)).unwrap_or(self.next);
            gaps += self.begin_anew();
        }
    }

    fn read_in_order(&mut self, frames: &mut Vec<Frame>) -> u64 {
        let mut gaps = 0;
        while let Some(octets) = self.take_next() {
            self.next = self.next.wrapping_add(octets.len() as u32);
            self.decoder.input().extend_from_slice(&octets);
            loop {
                match self.decoder.next_frame() {
                    Ok(Some(frame)) => frames.push(frame),
                    Ok(None) => break,
                    Err(_) => {
                        gaps += self.begin_anew();
                        break;
                    }
                }
            }
        }
        gaps
    }

    /// The octets that continue the stream, without those that were read already.
    fn take_next(&mut self) -> Option<Vec<u8>> {
        let next = self.next;
        // Earlier by less than half of all numbers.
        let read = |number: u32| next.wrapping_sub(number) as usize;
        let is_old = |number: u32| read(number) < 1 << 31;
        self.waiting
            .retain(|(number, octets)| !is_old(*number) || read(*number) < octets.len());
        let place = self
            .waiting
            .iter()
            .position(|(number, _)| is_old(*number))?;
        let (number, mut octets) = self.waiting.swap_remove(place);
        octets.drain(..read(number));
        Some(octets)
    }

    /// Goes on with a message that begins at the next octet. Returns the number of gaps that this
    /// makes: one, unless nothing was recognised before.
    fn begin_anew(&mut self) -> u64 {
        self.decoder = amid();
        u64::from(self.is_jaus)
    }
}

/// A decoder for a stream whose beginning, with its version, was not captured. Only Junior sends an
/// older version than AS5669A.
fn amid() -> Decoder {
    let mut decoder = Decoder::new();
    decoder.input().extend_from_slice(&[VERSION_AS5669A]);
    decoder
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;
    use jaus::address::JausId;
    use jaus::wire::{Frame, jtcp};

    fn message(number: u16) -> Vec<u8> {
        let payload = Bytes::from_static(&[0x00, 0x2B, 0x02]);
        let mut frame = Frame::new(JausId::new(101, 1, 1), JausId::new(102, 1, 1), payload);
        frame.sequence = number;
        jtcp::encode(&frame).unwrap()[1..].to_vec()
    }

    /// The octets of a connection from its version on: ten messages.
    fn ten() -> Vec<u8> {
        let messages = (0..10).flat_map(message);
        [VERSION_AS5669A].into_iter().chain(messages).collect()
    }

    fn segment(number: u32, syn: bool, octets: &[u8]) -> Segment<'_> {
        Segment {
            source: "10.0.0.1:4000".parse().unwrap(),
            destination: "10.0.0.2:3794".parse().unwrap(),
            number,
            syn,
            cut: false,
            octets,
        }
    }

    fn numbers(frames: &[Frame]) -> Vec<u16> {
        frames.iter().map(|frame| frame.sequence).collect()
    }

    #[test]
    fn segments_of_any_length_in_any_order_give_the_messages_once_and_in_order() {
        let octets = ten();
        // The sequence numbers wrap.
        for (begin, length) in [(0, 7), (u32::MAX - 20, 3), (u32::MAX - 50, 40), (5, 400)] {
            let parts: Vec<_> = octets.chunks(length).enumerate().collect();
            let mut streams = Streams::default();
            let mut frames = streams.insert(segment(begin, true, b""));
            for pair in parts.chunks(2) {
                for (index, part) in pair.iter().rev().chain(pair) {
                    let number = begin.wrapping_add(1 + (index * length) as u32);
                    frames.extend(streams.insert(segment(number, false, part)));
                }
            }
            assert_eq!(numbers(&frames), (0..10).collect::<Vec<_>>(), "{length}");
            assert_eq!(streams.gaps(), 0);
        }
    }

    #[test]
    fn a_connection_that_was_open_before_the_capture_is_read_from_its_next_message_on() {
        let mut streams = Streams::default();
        let frames = streams.insert(segment(77, false, &message(3)));
        assert_eq!(numbers(&frames), [3]);
    }

    #[test]
    fn after_a_gap_it_goes_on_with_the_next_segment_and_counts_the_gap() {
        let mut streams = Streams::default();
        let length = message(0).len() as u32;
        let mut frames = streams.insert(segment(0, false, &message(0)));
        for number in 2..=u32::try_from(MOST_WAITING).unwrap() + 3 {
            let octets = message(number as u16);
            frames.extend(streams.insert(segment(number * length, false, &octets)));
        }
        let expected: Vec<_> = [0].into_iter().chain(2..=MOST_WAITING as u16 + 3).collect();
        assert_eq!(numbers(&frames), expected);
        assert_eq!(streams.gaps(), 1);
    }

    #[test]
    fn what_is_not_jtcp_is_counted_and_streams_are_bounded() {
        let mut streams = Streams::default();
        for port in 0..1000 {
            let mut segment = segment(0, true, b"GET / HTTP/1.1\r\n");
            segment.source.set_port(port);
            assert!(streams.insert(segment).is_empty());
        }
        assert_eq!(
            (streams.foreign(), streams.known.len()),
            (1000, MOST_STREAMS)
        );
        assert_eq!(streams.gaps(), 0);
    }

    #[test]
    fn a_flood_of_one_sender_does_not_end_the_stream_of_another() {
        let mut streams = Streams::default();
        let octets = ten();
        let (first, second) = octets.split_at(octets.len() / 2);
        let of_other = |number, syn, octets| Segment {
            source: "10.0.0.3:4000".parse().unwrap(),
            ..segment(number, syn, octets)
        };
        streams.insert(of_other(0, true, b""));
        let mut all = streams.insert(of_other(1, false, first));
        for port in 0..1000 {
            let mut flood = segment(0, true, b"GET / HTTP/1.1\r\n");
            flood.source.set_port(port);
            streams.insert(flood);
        }
        all.extend(streams.insert(of_other(1 + first.len() as u32, false, second)));
        assert_eq!(all.len(), 10);
    }
}
