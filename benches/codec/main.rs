//! Encoding and decoding times of seven representative messages, compared with a hand-written
//! minimum and a copy of the octets in the same run.
//!
//! | | |
//! |---|---|
//! | pose32 | ReportGlobalPose, all nine optional fields |
//! | pose16 | the same with four of them |
//! | wrench26 | SetWrenchEffort, all twelve optional fields |
//! | services | ReportServices: 4 components of 6 services each, lists and strings |
//! | elements | SetElement: 32 elements with 20 octets of data each |
//! | time10 | ReportTime: two bit fields |
//! | event64k | Event with 64 KiB of report |
//!
//! Each figure is the *shortest* time per operation over short batches: the time that the code
//! takes while no other process uses the processor. `encode` appends to an existing buffer; `bytes`
//! allocates new shared octets. With `JAUS_WRITE_FIGURES` set, the table is written to
//! `docs/figures/codec.md`.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

mod handwritten;
mod samples;

use std::hint::black_box;
use std::time::{Duration, Instant};

use bytes::Bytes;
use criterion::measurement::WallTime;
use criterion::{Bencher, BenchmarkGroup, Criterion, criterion_group};
use jaus::codec::Message;
use jaus_test_kit::figures::Figures;

/// Runs in batches and takes the time of the shortest one for each of them.
fn least<T>(bencher: &mut Bencher<'_>, mut operation: impl FnMut() -> T) {
    #[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
    let now = Instant::now;
    bencher.iter_custom(|iterations| {
        let batch = iterations.clamp(1, 512);
        let mut shortest = Duration::MAX;
        for _ in 0..iterations.div_ceil(batch).max(16) {
            let start = now();
            for _ in 0..batch {
                black_box(operation());
            }
            shortest = shortest.min(now() - start);
        }
        shortest.mul_f64(iterations as f64 / batch as f64)
    });
}

/// Measures the codec of a message, and a copy of its octets as the limit.
fn codec<M: Message>(group: &mut BenchmarkGroup<'_, WallTime>, message: &M) {
    let octets = message.encode().unwrap();
    let mut buffer = Vec::with_capacity(octets.len());
    group.bench_function("encode", |bencher| {
        least(bencher, || {
            buffer.clear();
            black_box(message).encode_into(&mut buffer).unwrap();
            black_box(&buffer);
        });
    });
    group.bench_function("bytes", |bencher| {
        least(bencher, || black_box(&black_box(message).encode()).is_ok());
    });
    group.bench_function("decode", |bencher| {
        least(bencher, || {
            black_box(&M::decode(black_box(&octets))).is_ok()
        });
    });
    group.bench_function("memcpy", |bencher| {
        least(bencher, || {
            buffer.clear();
            buffer.extend_from_slice(black_box(&octets));
            black_box(&buffer);
        });
    });
    assert_eq!(M::decode(&octets).unwrap(), *message);
}

/// Measures a hand-written minimum that must give the same result.
fn by_hand<M: Message, H>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    message: &M,
    decode: impl Fn(&Bytes) -> H,
    encode: impl Fn(&H, &mut Vec<u8>),
) {
    let octets = message.encode().unwrap();
    let value = decode(&octets);
    let mut buffer = Vec::with_capacity(octets.len());
    encode(&value, &mut buffer);
    assert_eq!(buffer, octets);
    group.bench_function("encode by hand", |bencher| {
        least(bencher, || {
            buffer.clear();
            encode(black_box(&value), &mut buffer);
            black_box(&buffer);
        });
    });
    group.bench_function("decode by hand", |bencher| {
        least(bencher, || {
            black_box(&decode(black_box(&octets)));
        });
    });
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pose32");
    codec(&mut group, &samples::pose32());
    by_hand(
        &mut group,
        &samples::pose32(),
        handwritten::Pose::decode,
        handwritten::Pose::encode,
    );
    group.finish();

    let mut group = criterion.benchmark_group("pose16");
    codec(&mut group, &samples::pose16());
    group.finish();

    let mut group = criterion.benchmark_group("wrench26");
    codec(&mut group, &samples::wrench());
    group.finish();

    let mut group = criterion.benchmark_group("services");
    codec(&mut group, &samples::services());
    by_hand(
        &mut group,
        &samples::services(),
        handwritten::services::decode,
        |nodes, buffer| {
            handwritten::services::encode(nodes, buffer);
        },
    );
    group.finish();

    let mut group = criterion.benchmark_group("elements");
    codec(&mut group, &samples::elements());
    by_hand(
        &mut group,
        &samples::elements(),
        handwritten::Elements::decode,
        handwritten::Elements::encode,
    );
    group.finish();

    let mut group = criterion.benchmark_group("time10");
    codec(&mut group, &samples::time());
    group.finish();

    let mut group = criterion.benchmark_group("event64k");
    codec(&mut group, &samples::event());
    group.finish();
}

criterion_group! {
    name = all;
    config = Criterion::default()
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(400))
        .sample_size(10);
    targets = benches
}

/// The messages by their group of benchmarks.
const MESSAGES: [(&str, &str); 7] = [
    (
        "pose32",
        "ReportGlobalPose, all 9 optional fields, 32 octets",
    ),
    ("pose16", "the same with 4 of them"),
    ("wrench26", "SetWrenchEffort, all 12"),
    ("services", "ReportServices, 4 components of 6 services"),
    ("elements", "SetElement, 32 elements"),
    ("time10", "ReportTime, two bit fields"),
    ("event64k", "Event with 64 KiB"),
];

const COLUMNS: [&str; 5] = [
    "encode",
    "encode by hand",
    "decode",
    "decode by hand",
    "memcpy",
];

fn main() {
    let mut figures = Figures::new(
        "codec",
        "cargo bench --bench codec --no-default-features --features mobility",
    );
    all();
    let cells = |group| COLUMNS.map(|function| figures.criterion(group, function).map(time));
    let rows = MESSAGES.map(|(group, message)| (message, cells(group)));
    if rows.iter().any(|(_, cells)| cells[0].is_none()) {
        // Arguments have selected some of the benchmarks.
        return;
    }
    let title = "Least time for a message";
    figures.table(
        title,
        [
            "message",
            "encode",
            "by hand",
            "decode",
            "by hand",
            "copy of the octets",
        ],
    );
    for (message, cells) in &rows {
        let [a, b, c, d, e] = cells.each_ref().map(|it| it.as_deref().unwrap_or_default());
        figures.row([message, a, b, c, d, e]);
    }
    figures.finish();
}

fn time(nanoseconds: f64) -> String {
    match nanoseconds {
        short if short < 1000.0 => format!("{short:.1} ns"),
        long => format!("{:.2} µs", long / 1000.0),
    }
}
