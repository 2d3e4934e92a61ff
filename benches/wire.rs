//! The cost of a datagram: its header alone, the whole frame, and its way through an endpoint. With
//! `JAUS_WRITE_FIGURES` set, the table is written to `docs/figures/wire.md`.

#![expect(clippy::expect_used, reason = "a benchmark")]

use std::hint::black_box;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};
use criterion::{BatchSize, Criterion, Throughput, criterion_group};
use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, LinkId, LinkProfile, Outgoing, Path, StaticPeer};
use jaus::wire::{Flags, Frame, as5669a, judp, ra};
use jaus_test_kit::figures::Figures;

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(42, 1, 1);

fn frame(payload: usize) -> Frame {
    Frame {
        sequence: 7,
        ..Frame::new(PEER, US, vec![0x44; payload].into())
    }
}

/// The minimal code that reads an uncompressed header: one length check, five loads.
fn by_hand(octets: &[u8]) -> Option<(u8, u16, u8, JausId, JausId)> {
    let &[kind, s0, s1, flags, d0, d1, d2, d3, a0, a1, a2, a3] = octets.first_chunk()?;
    let (destination, source) = ([d0, d1, d2, d3], [a0, a1, a2, a3]);
    let size = u16::from_le_bytes([s0, s1]);
    Some((
        kind,
        size,
        flags,
        JausId::from_wire(destination),
        JausId::from_wire(source),
    ))
}

fn header(c: &mut Criterion) {
    let mut group = c.benchmark_group("header");
    let datagram = judp::encode(&frame(50)).expect("a datagram");
    group.bench_function("as5669a/decode", |b| {
        b.iter(|| as5669a::Header::decode(black_box(&datagram[1..])).expect("a header"));
    });
    group.bench_function("as5669a/decode by hand", |b| {
        b.iter(|| by_hand(black_box(&datagram[1..])).expect("a header"));
    });
    let mut out = BytesMut::with_capacity(64);
    group.bench_function("as5669a/encode", |b| {
        b.iter(|| {
            out.clear();
            as5669a::Header::new(black_box(Flags::default()), PEER, US, 64)
                .encode(&mut out)
                .expect("a plain header");
        });
    });
    group.bench_function("ra/decode", |b| {
        b.iter(|| ra::Header::decode(black_box(&datagram[1..])).expect("a header"));
    });
    group.finish();
}

fn datagram(c: &mut Criterion) {
    let mut group = c.benchmark_group("datagram");
    for payload in [50, 1425] {
        let frame = frame(payload);
        let datagram = judp::encode(&frame).expect("a datagram");
        group.throughput(Throughput::Bytes(datagram.len() as u64));
        group.bench_function(format!("read/{payload}"), |b| {
            b.iter(|| {
                judp::frames(black_box(&datagram).clone())
                    .expect("JAUS")
                    .next()
            });
        });
        group.bench_function(format!("write/{payload}"), |b| {
            b.iter(|| judp::encode(black_box(&frame)).expect("a datagram"));
        });
    }
    group.finish();
}

/// An endpoint that knows one peer, optionally by its configured address, with a fixed clock.
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn endpoint(is_configured: bool) -> (Endpoint, Path, Instant) {
    let peer = Path {
        link: LinkId(0),
        peer: SocketAddr::from(([10, 0, 0, 2], judp::PORT)).into(),
    };
    let now = Instant::now();
    let configured = StaticPeer {
        id: PEER,
        path: peer,
        gets_broadcasts: false,
    };
    let mut endpoint = Endpoint::new(Config {
        static_peers: is_configured.then_some(configured).into_iter().collect(),
        ..Config::default()
    });
    let own = SocketAddr::from(([10, 0, 0, 1], judp::PORT));
    endpoint.add_link(LinkId(0), LinkProfile::judp([own]));
    endpoint.attach(US).expect("an id of one component");
    let datagram = judp::encode(&frame(2)).expect("a datagram");
    endpoint.handle_datagram(now, peer, datagram, &mut Vec::new());
    while endpoint.poll_event().is_some() {}
    (endpoint, peer, now)
}

fn through_an_endpoint(c: &mut Criterion) {
    let mut group = c.benchmark_group("endpoint");
    for payload in [50, 1425] {
        let (mut receiver, path, mut now) = endpoint(false);
        let mut received = Vec::with_capacity(1);
        let mut sequence = 0;
        group.bench_function(format!("receive/{payload}"), |b| {
            b.iter_batched(
                || {
                    sequence += 1;
                    judp::encode(&Frame {
                        sequence,
                        ..frame(payload)
                    })
                    .expect("a datagram")
                },
                |datagram| {
                    now += Duration::from_micros(100);
                    receiver.handle_datagram(now, path, datagram, &mut received);
                    received.pop().expect("a message that is delivered")
                },
                BatchSize::SmallInput,
            );
        });
        // Without a configured address a peer is rate-limited until it has acknowledged something.
        let (mut sender, _, now) = endpoint(true);
        let message = Outgoing::new(US, PEER, Bytes::from(vec![0x44; payload]));
        group.bench_function(format!("send/{payload}"), |b| {
            b.iter(|| {
                sender
                    .send(now, message.clone(), &mut received)
                    .expect("a known peer");
                sender.poll_transmit(now).expect("a datagram")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, header, datagram, through_an_endpoint);

/// Steps by their group and name among the benchmarks.
const STEPS: [(&str, &str, &str); 12] = [
    ("header", "as5669a/decode", "read a header"),
    ("header", "as5669a/decode by hand", "the same by hand"),
    ("header", "as5669a/encode", "write a header"),
    (
        "header",
        "ra/decode",
        "read a header of the Reference Architecture",
    ),
    ("datagram", "read/50", "read a datagram of 50 octets"),
    ("datagram", "read/1425", "read a datagram of 1425 octets"),
    ("datagram", "write/50", "write a datagram of 50 octets"),
    ("datagram", "write/1425", "write a datagram of 1425 octets"),
    (
        "endpoint",
        "receive/50",
        "receive 50 octets through an endpoint",
    ),
    (
        "endpoint",
        "receive/1425",
        "receive 1425 octets through an endpoint",
    ),
    ("endpoint", "send/50", "send 50 octets through an endpoint"),
    (
        "endpoint",
        "send/1425",
        "send 1425 octets through an endpoint",
    ),
];

/// The aim for receiving a small message, in nanoseconds.
const AIM: f64 = 400.0;

fn main() {
    let mut figures = Figures::new("wire", "cargo bench --bench wire");
    benches();
    let measured = STEPS.map(|(group, function, step)| (step, figures.criterion(group, function)));
    let received = measured[8].1;
    // Otherwise arguments have selected some of the benchmarks.
    if measured.iter().all(|(_, time)| time.is_some()) {
        figures.table("Median time of a datagram", ["step", "time"]);
        for (step, time) in measured {
            figures.row([step, &format!("{:.1} ns", time.unwrap_or_default())]);
        }
        let is_met = received.is_some_and(|time| time <= AIM);
        figures.aim("a small message received within 0.4 µs", [("", is_met)]);
        figures.finish();
    }
}
