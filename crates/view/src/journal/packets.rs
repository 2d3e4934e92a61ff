//! Conversion of node traffic to IP packets for a capture.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};

use bytes::Bytes;

use crate::network::{JAUS_PORT, udp_packet};
use crate::stream::{Links, Seen, timestamp};
use jaus::endpoint::{LinkId, Remote, To};
use jaus::node::{Passage, Way};
use jaus::wire::{DataControl, Frame, judp};

/// Maximum payload per packet for messages that were not datagrams.
const MOST: usize = 60_000;
/// Substitute address for messages within the node and on serial lines.
const NOWHERE: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), JAUS_PORT);

/// An IP packet and its interface.
#[derive(Debug)]
pub(super) struct Packet {
    pub(super) interface: String,
    pub(super) octets: Vec<u8>,
}

/// Converts passages to packets.
#[derive(Debug, Default)]
pub(super) struct Packets {
    /// `None` for links other than UDP.
    ends: BTreeMap<LinkId, Option<Ends>>,
    seen: Seen,
    /// The last sequence number assigned to a message within the node, which has none of its own.
    number: u16,
}

/// The addresses of a UDP link.
#[derive(Debug, Clone, Copy)]
struct Ends {
    local: SocketAddr,
    group: Option<SocketAddr>,
}

impl Packets {
    /// The packets of a passage; empty if they have already been recorded.
    pub(super) fn of(&mut self, passage: &Passage, links: &mut Links) -> Vec<Packet> {
        let interface = match passage.way {
            Way::In(path) => links.name(path.link).to_owned(),
            Way::Out(link, _) => links.name(link).to_owned(),
            Way::Local(_) => "local".to_owned(),
        };
        let (source, destination) = self.addresses(passage.way, links);
        if matches!(passage.way, Way::In(_)) && self.is_ours(source) {
            // Our own multicast, looped back.
            return Vec::new();
        }
        let datagrams = self.datagrams(passage);
        let packets = datagrams.iter().filter_map(|datagram| {
            let octets = udp_packet(source, destination, datagram)
                .or_else(|| udp_packet(NOWHERE, NOWHERE, datagram))?;
            Some(Packet {
                interface: interface.clone(),
                octets,
            })
        });
        packets.collect()
    }

    fn datagrams(&mut self, passage: &Passage) -> Vec<Bytes> {
        let is_local = matches!(passage.way, Way::Local(_));
        let time = timestamp(passage.time);
        let frames = passage.frames();
        let mut second_ways = 0;
        for frame in &frames {
            second_ways += usize::from(self.seen.is_second_way(passage.way, frame, time));
        }
        if second_ways > 0 {
            return Vec::new();
        }
        let datagrams = passage.datagrams();
        if !datagrams.is_empty() {
            return datagrams;
        }
        let cut = frames.iter().flat_map(|frame| self.cut(frame, is_local));
        cut.filter_map(|frame| judp::encode(&frame).ok()).collect()
    }

    /// Splits a local message into frames that fit into datagrams.
    fn cut(&mut self, frame: &Frame, is_local: bool) -> Vec<Frame> {
        if !is_local {
            return vec![frame.clone()];
        }
        let count = frame.payload.len().div_ceil(MOST).max(1);
        (0..count)
            .map(|index| {
                let start = index * MOST;
                let end = (start + MOST).min(frame.payload.len());
                let data = match index {
                    _ if count == 1 => DataControl::Single,
                    0 => DataControl::First,
                    index if index + 1 == count => DataControl::Last,
                    _ => DataControl::Middle,
                };
                // Zero means no number.
                self.number = self.number.checked_add(1).unwrap_or(1);
                Frame {
                    flags: frame.flags.with_data(data),
                    sequence: self.number,
                    payload: frame.payload.slice(start..end),
                    ..frame.clone()
                }
            })
            .collect()
    }

    fn addresses(&mut self, way: Way, links: &Links) -> (SocketAddr, SocketAddr) {
        let socket = |peer: Remote| peer.socket().unwrap_or(NOWHERE);
        match way {
            Way::In(path) => {
                let ends = self.ends(path.link, links);
                (socket(path.peer), ends.map_or(NOWHERE, |ends| ends.local))
            }
            Way::Out(link, to) => {
                let ends = self.ends(link, links);
                let to = match to {
                    To::Peer(peer) => socket(peer),
                    To::Group => ends.and_then(|ends| ends.group).unwrap_or(NOWHERE),
                };
                (ends.map_or(NOWHERE, |ends| ends.local), to)
            }
            Way::Local(_) => (NOWHERE, NOWHERE),
        }
    }

    fn ends(&mut self, link: LinkId, links: &Links) -> Option<Ends> {
        if !self.ends.contains_key(&link) {
            let reports = links.node().links().into_iter();
            self.ends.extend(reports.map(|report| {
                let ends = Ends {
                    local: report.local,
                    group: report.group,
                };
                (report.link, Some(ends))
            }));
        }
        *self.ends.entry(link).or_default()
    }

    fn is_ours(&self, source: SocketAddr) -> bool {
        self.ends
            .values()
            .flatten()
            .any(|ends| ends.local == source)
    }
}
