//! Datagrams: decoding and encoding them, and an endpoint that receives them.
//!
//! The first octet chooses. 0: the rest is one datagram, whose messages must round-trip through the
//! encoder. Otherwise the rest drives an endpoint, and the octet's bits enable options (forwarding,
//! packing, rate limits, fragments): each step is an octet for the operation, and octets for its
//! arguments. Tables and queues are small, so that they reach their limits.
#![no_main]

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{
    Config, Endpoint, Limits, LinkId, LinkProfile, Outgoing, Pacing, Packing, Path, Rate, Routing,
};
use jaus::wire::{Broadcast, Flags, Frame, Kind, Priority, Version, judp};
use libfuzzer_sys::fuzz_target;

/// Time zero of every input.
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

const QUEUE_LIMIT: usize = 16;
const REASSEMBLY_LIMIT: usize = 2048;

fuzz_target!(|octets: &[u8]| {
    match octets.split_first() {
        Some((0, datagram)) => frames_come_back(datagram),
        Some((&choices, story)) => play(choices, story),
        None => {}
    }
});

fn frames_come_back(datagram: &[u8]) {
    let Ok(mut frames) = judp::frames(Bytes::copy_from_slice(datagram)) else {
        return;
    };
    for frame in frames.by_ref().flatten() {
        let Ok(written) = judp::encode(&frame) else {
            continue;
        };
        let again = judp::frames(written).expect("its own first octets").next();
        assert_eq!(again, Some(Ok(frame)));
    }
    assert!(frames.offset() + frames.remaining() <= datagram.len().max(frames.offset()));
}

/// The octets that drive the endpoint; zeros at their end.
struct Story<'a>(&'a [u8]);

impl<'a> Story<'a> {
    fn octet(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        first
    }

    fn number(&mut self) -> u16 {
        u16::from_le_bytes([self.octet(), self.octet()])
    }

    fn octets(&mut self) -> &'a [u8] {
        let length = usize::from(self.number()).min(self.0.len());
        let (octets, rest) = self.0.split_at(length);
        self.0 = rest;
        octets
    }

    /// One of a few ids, so that they coincide; sometimes any.
    fn id(&mut self) -> JausId {
        match self.octet() {
            id @ 0..8 => JausId::new(1, 1 + id / 4, 1 + id % 4),
            id @ 8..16 => JausId::new(2, 1, id),
            16 => JausId::EVERYONE,
            17 => JausId::new(1, 1, JausId::ANY_COMPONENT),
            18 => JausId::new(1, JausId::ANY_NODE, 1),
            _ => JausId::new(self.number(), self.octet(), self.octet()),
        }
    }

    fn path(&mut self) -> Path {
        let choice = self.octet();
        let address = Ipv4Addr::new(10, 0, 0, choice >> 2);
        Path {
            link: LinkId(u16::from(choice & 3)),
            peer: SocketAddr::new(address.into(), 3794).into(),
        }
    }

    fn frame(&mut self) -> Frame {
        let version = match self.octet() % 4 {
            0 => Version::As5669,
            1 => Version::Ra,
            _ => Version::As5669a,
        };
        Frame {
            version,
            kind: Kind::default(),
            flags: Flags(self.octet()),
            destination: self.id(),
            source: self.id(),
            sequence: u16::from(self.octet() % 8),
            payload: Bytes::copy_from_slice(self.octets()),
        }
    }

    fn outgoing(&mut self) -> Outgoing {
        let flags = self.octet();
        Outgoing {
            source: self.id(),
            destination: self.id(),
            priority: [Priority::Low, Priority::Standard, Priority::High][usize::from(flags % 3)],
            broadcast: [Broadcast::None, Broadcast::Local, Broadcast::Global]
                [usize::from(flags / 3 % 3)],
            acknowledge: flags & 0x80 != 0,
            payload: Bytes::copy_from_slice(self.octets()),
        }
    }
}

fn config(choices: u8) -> Config {
    let chosen = |bit: u8| choices & (1 << bit) != 0;
    let limit = |bit| chosen(bit).then_some(Rate::new(50, 5));
    Config {
        routing: Routing {
            forward: chosen(0),
            ..Routing::default()
        },
        packing: if chosen(1) {
            Packing::Within(Duration::from_millis(5))
        } else {
            Packing::Off
        },
        pacing: (!chosen(2)).then_some(Pacing {
            burst: 4096,
            rate: 100_000,
        }),
        limits: Limits {
            max_peers: 4,
            new_ids_per_address: Rate::new(64, 8),
            messages_per_address: limit(3),
            messages_per_id: limit(4),
        },
        max_message: if chosen(5) { 100 } else { 4096 },
        max_reassembly_per_sender: 1024,
        max_reassembly: REASSEMBLY_LIMIT,

        max_components: 4,
        max_recent: 16,
        max_unacknowledged: 4,
        queue_limit: QUEUE_LIMIT,
        payload_limit: 64,
        ..Config::default()
    }
}

fn play(choices: u8, story: &[u8]) {
    let mut story = Story(story);
    let mut now = *START;
    let mut endpoint = Endpoint::new(config(choices));
    let mine = JausId::new(1, 1, 1);
    endpoint.attach(mine).expect("the first component");
    endpoint.add_link(LinkId(0), LinkProfile::judp([]));
    let mut received = Vec::new();
    while !story.0.is_empty() {
        match story.octet() % 10 {
            0 => {
                let (path, datagram) = (story.path(), story.octets());
                let datagram = Bytes::copy_from_slice(datagram);
                endpoint.handle_datagram(now, path, datagram, &mut received);
            }
            1..4 => {
                let (path, frame) = (story.path(), story.frame());
                if let Ok(datagram) = judp::encode(&frame) {
                    endpoint.handle_datagram(now, path, datagram, &mut received);
                }
            }
            4 => {
                now += Duration::from_millis(u64::from(story.number()));
                endpoint.handle_timeout(now);
            }
            5 => _ = endpoint.send(now, story.outgoing(), &mut received),
            6 => _ = endpoint.attach(story.id()),
            7 => endpoint.detach(story.id()),
            8 => {
                let link = LinkId(u16::from(story.octet() & 3));
                endpoint.add_link(link, LinkProfile::judp(story.path().peer.socket()));
            }
            _ => drain(&mut endpoint, now),
        }
        for message in received.drain(..) {
            assert!(message.source.is_unicast() && message.to.is_unicast());
            assert!(message.destination.matches(message.to));
        }
        assert!(endpoint.components().count() <= 4);
        assert!(endpoint.peers().count() <= 4);
        assert!(endpoint.unfinished() <= REASSEMBLY_LIMIT);
    }
    drain(&mut endpoint, now);
    settle(&mut endpoint, now);
}

/// Takes all output of the endpoint, and checks its externally visible invariants.
fn drain(endpoint: &mut Endpoint, now: Instant) {
    // Events have one queue, datagrams one per priority.
    let most = QUEUE_LIMIT * 8;
    let taken = std::iter::from_fn(|| endpoint.poll_event()).count();
    assert!(taken <= most, "more events than the queues hold");
    let mut sent = 0;
    while let Some(transmit) = endpoint.poll_transmit(now) {
        sent += 1;
        assert!(sent <= most, "more datagrams than the queues hold");
        let frames: Vec<_> = judp::frames(transmit.payload).expect("our own").collect();
        assert!(
            !frames.is_empty() && frames.iter().all(Result::is_ok),
            "{frames:?}"
        );
    }
}

/// Without new datagrams an endpoint comes to rest: no endless chain of wake-ups.
fn settle(endpoint: &mut Endpoint, mut now: Instant) {
    for _ in 0..1000 {
        let Some(wake_up) = endpoint.poll_timeout() else {
            return;
        };
        now = now.max(wake_up);
        endpoint.handle_timeout(now);
        drain(endpoint, now);
    }
    panic!("the endpoint never comes to rest");
}
