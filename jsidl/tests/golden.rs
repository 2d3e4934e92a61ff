//! The dynamic codec against encodings that an independent code generator produced.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

mod support;

use std::fs;

use jsidl::dynamic::{raw_from_real, real_from_raw, shortest_real};
use jsidl::model::{Rounding, Scale, Unsigned};
use serde_json::Value as Json;

/// The lines of a file of golden data.
fn lines(path: &std::path::Path) -> Vec<Json> {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn scale_of(row: &Json) -> (Scale, Unsigned) {
    let width = match row["type"].as_str().unwrap() {
        "unsigned byte" => Unsigned::U8,
        "unsigned short integer" => Unsigned::U16,
        "unsigned integer" => Unsigned::U32,
        other => panic!("{other} is no scaled type"),
    };
    let limit = |key: &str| row[key].as_f64().unwrap();
    let (lower, upper) = (limit("lower"), limit("upper"));
    (
        Scale {
            lower,
            upper,
            rounding: Rounding::Round,
        },
        width,
    )
}

#[test]
fn real_numbers_become_the_integers_of_exact_rounding() {
    let Some(shared) = support::shared() else {
        return;
    };
    let rows = lines(&shared.join("golden/scaling_encode.jsonl"));
    for row in &rows {
        let (scale, width) = scale_of(row);
        let raw = raw_from_real(&scale, width, row["real"].as_f64().unwrap());
        assert_eq!(raw, row["round_half_up"].as_u64(), "{row}");
    }
    println!("{} real numbers", rows.len());
    assert!(rows.len() > 1000);
}

#[test]
fn integers_become_the_real_numbers_they_stand_for() {
    let Some(shared) = support::shared() else {
        return;
    };
    let rows = lines(&shared.join("golden/scaling_decode.jsonl"));
    for row in &rows {
        let (scale, width) = scale_of(row);
        let raw = row["raw"].as_u64().unwrap();
        assert_eq!(
            Some(real_from_raw(&scale, width, raw)),
            row["jts_real"].as_f64(),
            "{row}"
        );
        let shortest = shortest_real(&scale, width, raw);
        assert_eq!(
            raw_from_real(&scale, width, shortest),
            Some(raw),
            "{row}: {shortest}"
        );
    }
    println!("{} integers", rows.len());
    assert!(rows.len() > 300);
}
