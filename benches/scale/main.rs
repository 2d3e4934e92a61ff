//! Duration and memory of planning, on maps up to the largest.
//!
//! ```sh
//! cargo bench --bench scale
//! JAUS_WRITE_FIGURES=1 cargo bench --bench scale    # also writes docs/figures/planning.md
//! ```
//!
//! Each row is the median of a few runs. Memory is the peak of the process in one run, beyond the
//! map itself (Linux).
#![expect(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::time::{Duration, Instant};

use jaus_test_kit::figures::Figures;
use jaus_vehicle::mission::{Footprint, Terrain, plan};

const RUNS: usize = 3;

fn main() {
    let mut figures = Figures::new("planning", "cargo bench --bench scale");
    figures.table(
        "A path from corner to corner",
        ["map and ground", "time", "memory", "segments", "length"],
    );
    for side in [16, 256, 512, 1024, 4096] {
        for (name, ground) in GROUNDS {
            row(&mut figures, side, name, ground);
        }
    }
    figures.finish();
}

type Ground = fn(usize, usize, usize) -> u8;

/// Kinds of terrain: each gives the cell at a row and column of a map of a given side length.
const GROUNDS: [(&str, Ground); 5] = [
    ("open", |_, _, _| 255),
    ("uneven", |row, column, _| {
        1 + random(row / 8, column / 8) % 255
    }),
    ("boulders", |row, column, side| {
        let is_boulder = random(row / 4, column / 4).is_multiple_of(5);
        let is_corner = row.max(column) < 8 || row.min(column) + 8 >= side;
        if is_boulder && !is_corner { 0 } else { 255 }
    }),
    ("maze", |row, column, side| {
        let apart = (side / 16).clamp(4, 64);
        let at_left = (row / apart).is_multiple_of(2);
        let gap = if at_left {
            column + 3 >= side
        } else {
            column < 3
        };
        if row % apart == apart - 1 && !gap {
            0
        } else {
            255
        }
    }),
    ("walled in", |row, column, side| {
        let wall = side - 4;
        let is_wall = (row == wall && column >= wall) || (column == wall && row >= wall);
        if is_wall { 0 } else { 255 }
    }),
];

/// A pseudorandom number for a cell, the same in every run.
fn random(row: usize, column: usize) -> u8 {
    let mut seed = ((row as u64) << 32) | column as u64;
    seed = (seed ^ (seed >> 30))
        .wrapping_mul(0xBF58_476D_1CE4_E5B9)
        .wrapping_add(0x9E37);
    seed = (seed ^ (seed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (seed >> 40) as u8
}

fn row(figures: &mut Figures, side: usize, name: &str, ground: Ground) {
    let cells = (0..side * side)
        .map(|at| ground(at / side, at % side, side))
        .collect();
    let sides = side as u16;
    let Ok(terrain) = Terrain::new(sides, sides, 0.1, (0.0, 0.0), cells) else {
        return;
    };
    let end = side as f64 * 0.1 - 0.05;
    let thin = Footprint {
        width: 0.1,
        margin: 0.0,
        ..Footprint::default()
    };
    let mut times = Vec::new();
    let mut memory = 0;
    let mut found = ["none".to_owned(), "none".to_owned()];
    for _ in 0..RUNS {
        let before = reset_peak();
        let begin = Instant::now();
        let path = plan(&terrain, &thin, (0.05, 0.05), (end, end));
        times.push(begin.elapsed());
        memory = memory.max(peak().saturating_sub(before));
        if let Ok(path) = path {
            let length = format!("{:.1} m", path.length());
            found = [path.segments().len().to_string(), length];
        }
    }
    times.sort();
    let time: Duration = times[RUNS / 2];
    let [segments, length] = &found;
    figures.row([
        &format!("{side} x {side}, {name}"),
        &format!("{:.1} ms", time.as_secs_f64() * 1e3),
        &format!("{:.1} MiB", memory as f64 / 1024.0),
        segments,
        length,
    ]);
}

/// Resets the peak to the current memory; returns it in KiB.
fn reset_peak() -> u64 {
    // If this fails, the peak is that of the whole run.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    status("VmRSS:")
}

fn peak() -> u64 {
    status("VmHWM:")
}

fn status(key: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let number = line.and_then(|line| line.split_whitespace().next());
    number.and_then(|number| number.parse().ok()).unwrap_or(0)
}
