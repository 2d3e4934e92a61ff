//! The cost of a message in a recording, and the memory of the black box.
//!
//! ```text
//! cargo bench -p jaus-viewers --bench recording
//! JAUS_WRITE_FIGURES=1 cargo bench -p jaus-viewers --bench recording    also writes docs/figures
//! ```
//!
//! The traffic is that of a moving vehicle: poses and velocities, in turns. Files are written to
//! memory, so that the figures are those of the program and not of a disk.
#![expect(
    clippy::expect_used,
    clippy::disallowed_methods,
    reason = "a benchmark owns the clock and panics on failure"
)]

use std::alloc::System;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::{Frame as Message, judp};
use jaus_test_kit::figures::Figures;
use jaus_view::{Dictionary, Frame, LinkType, Network, Request, Timestamp, udp_packet};
use jaus_viewers::{BlackBox, BlackBoxLimits, Kept, Recorder, RecordingFormat};
use serde_json::json;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Messages in a recording.
const MESSAGES: usize = 50_000;
/// Repetitions, in turns.
const RUNS: usize = 5;
/// Limits of the black box, in MiB.
const LIMITS: [usize; 3] = [1, 16, 64];

fn main() {
    let mut figures = Figures::new("recording", "cargo bench -p jaus-viewers --bench recording");
    let dictionary = Dictionary::new().with_catalogue();
    let packets = packets(&dictionary);
    recordings(&dictionary, &packets, &mut figures);
    black_boxes(&packets, &mut figures);
    figures.finish();
}

/// The packets of a vehicle's poses and velocities.
fn packets(dictionary: &Dictionary) -> Vec<Bytes> {
    let encode = |number: usize| {
        let turn = number as f64 / MESSAGES as f64;
        let request = match number % 2 {
            0 => Request::new(
                "ReportLocalPose",
                json!({ "X": 100.0 * turn, "Y": -50.0 * turn, "Z": 0.0, "Yaw": turn }),
            ),
            _ => Request::new(
                "ReportVelocityState",
                json!({ "Velocity_X": turn, "YawRate": -turn }),
            ),
        };
        let octets = dictionary.write(&request).expect("the message is valid");
        let source = JausId::new(101, 1, 40);
        let mut frame = Message::new(source, JausId::new(42, 1, 1), octets);
        frame.sequence = (number % 60_000 + 1) as u16;
        let datagram = judp::encode(&frame).expect("it fits");
        let address = |last| SocketAddr::from(([10, 0, 0, last], 3794));
        let packet = udp_packet(address(1), address(2), &datagram);
        packet.expect("it fits").into()
    };
    (0..MESSAGES).map(encode).collect()
}

fn frame(number: usize, octets: &[u8]) -> Frame<'_> {
    let time = Duration::from_millis(number as u64);
    Frame {
        time: Some(Timestamp::since_1970(time, 9)),
        link: LinkType::RAW,
        octets,
        lost: 0,
        length: octets.len() as u32,
        interface: "eth0",
    }
}

fn recordings(dictionary: &Dictionary, packets: &[Bytes], figures: &mut Figures) {
    let formats = [RecordingFormat::Pcapng, RecordingFormat::Mcap];
    let (mut times, mut octets) = ([vec![], vec![]], [0, 0]);
    for _ in 0..RUNS {
        for (place, format) in formats.into_iter().enumerate() {
            let start = Instant::now();
            let network = Network::by_content();
            let mut recorder =
                Recorder::new(Vec::new(), format, dictionary, network).expect("memory is writable");
            for (number, packet) in packets.iter().enumerate() {
                let written = recorder.write_frame(&frame(number, packet));
                written.expect("memory is writable");
            }
            octets[place] = recorder.finish().expect("memory is writable");
            times[place].push(start.elapsed().as_secs_f64() * 1e6 / MESSAGES as f64);
        }
    }
    let packet = packets.iter().map(Bytes::len).sum::<usize>() / MESSAGES;
    figures.table(
        "Recording poses and velocities",
        [
            "format",
            "octets per message",
            "per message (µs)",
            "messages/s",
        ],
    );
    figures.row(["IP packet", &packet.to_string(), "", ""]);
    for (place, format) in formats.iter().enumerate() {
        let per_message = octets[place] / MESSAGES as u64;
        figures.row([
            &format.to_string(),
            &per_message.to_string(),
            &spread(&times[place]),
            &format!("{:.0}", 1e6 / median(&times[place])),
        ]);
    }
}

fn black_boxes(packets: &[Bytes], figures: &mut Figures) {
    figures.table(
        "Memory of the black box, full",
        [
            "limit (MiB)",
            "allocated (MiB)",
            "messages in memory",
            "per message (ns)",
        ],
    );
    for limit in LIMITS {
        let octets = limit << 20;
        let region = Region::new(ALLOCATOR);
        let mut kept = BlackBox::new(BlackBoxLimits {
            time: Duration::MAX,
            octets,
        });
        let (start, mut count) = (Instant::now(), 0);
        // Twice what fits, so that the oldest messages go.
        while count * 200 < 2 * octets {
            let packet = &packets[count % packets.len()];
            let frame = Kept {
                interface: "eth0".into(),
                link: LinkType::RAW,
                time: Timestamp::since_1970(Duration::ZERO, 9),
                octets: Bytes::copy_from_slice(packet),
                lost: 0,
            };
            kept.push(start, frame);
            count += 1;
        }
        let nanoseconds = start.elapsed().as_nanos() / count as u128;
        let stats = region.change();
        let held = stats.bytes_allocated as i64 + stats.bytes_reallocated as i64
            - stats.bytes_deallocated as i64;
        let held = held as f64 / f64::from(1 << 20);
        let messages = kept.snapshot().frames().len();
        figures.row([
            &limit.to_string(),
            &format!("{held:.1}"),
            &messages.to_string(),
            &nanoseconds.to_string(),
        ]);
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Median, least and greatest.
fn spread(values: &[f64]) -> String {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(0.0, f64::max);
    format!("{:.2} [{least:.2}..{greatest:.2}]", median(values))
}
