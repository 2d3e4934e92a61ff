//! One dead-man from the operator's last sign of life to the motor: a real Chromium on a display, with real key and
//! mouse events (`xdotool`), touches by its DevTools protocol, and a played gamepad; a relay that treats IP packets as a
//! radio link does; a station, and the parts of a vehicle as processes; and the motor controller at the end of
//! its serial line, where commands are measured.
//!
//! Tests measure some cells. `.ci/dead-man` measures all of them and writes the table of docs/safety.md.

mod bed;
mod cell;
mod link;
mod measurement;
mod motor;
mod operator;
mod relay;
mod table;

use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::hosts::on_hosts;

use self::bed::Bed;
use self::cell::Cell;
use self::link::Link;
use self::measurement::Measurement;
use self::operator::{Event, Source, Stop};
use crate::e2e::{browser, system};

#[test]
#[ignore = "measures times: alone on the machine, by .ci/run"]
fn released_or_lost_keys_and_touches_stop_the_motors_in_time() {
    on_a_bed(|bed| {
        let mut measurement = Measurement::new(bed);
        let mut cells = Vec::new();
        for link in [Link::DIRECT, Link::DELAYED, Link::CUT] {
            for source in [Source::Keys, Source::Touch] {
                for event in [Event::Release, Event::ContextMenu, Event::Blur] {
                    cells.push(measurement.event(source, event, link));
                }
            }
        }
        all_are_met(&cells);
    });
}

#[test]
#[ignore = "measures times: alone on the machine, by .ci/dead-man"]
fn an_emergency_stop_overtakes_what_is_held_on_a_slow_link() {
    on_a_bed(|bed| {
        let mut measurement = Measurement::new(bed);
        let held = [2, 5, 12].map(Duration::from_secs);
        let mut stop = |link, held| measurement.stop(Source::Keys, Stop::Escape, link, held);
        let mut cells = Vec::from(held.map(|it| stop(Link::SLOW_UP, it)));
        cells.extend(held.map(|it| stop(Link::SLOW, it)));
        all_are_met(&cells);
    });
}

/// Requires that every cell met its limit; names those that did not.
#[track_caller]
fn all_are_met(cells: &[Cell]) {
    let missed = cells.iter().filter(|it| !it.is_met());
    let missed: Vec<_> = missed
        .map(|it| {
            format!(
                "{}: {it}, limit {:.2} s [{}]",
                it.name,
                it.limit.as_secs_f64(),
                it.line
            )
        })
        .collect();
    assert!(
        missed.is_empty(),
        "missed by {} of {}:\n{}",
        missed.len(),
        cells.len(),
        missed.join("\n")
    );
}

/// Runs a test with all hosts and programs. One at a time: it measures times.
fn on_a_bed(body: impl FnOnce(&Bed)) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let lacks = |program: &str| Command::new(program).arg("-help").output().is_err();
    let tools = ["Xvfb", "xdotool"].into_iter().filter(|it| lacks(it));
    let missing: Vec<_> = browser::missing()
        .into_iter()
        .chain(tools.map(str::to_owned))
        .collect();
    if !missing.is_empty() {
        return not_tested(
            &this_test(),
            &format!("not installed: {}", missing.join(", ")),
        );
    }
    let missing = system::missing();
    if !missing.is_empty() {
        return not_tested(&this_test(), &format!("not built: {}", missing.join(", ")));
    }
    on_hosts(Bed::new, body);
}
