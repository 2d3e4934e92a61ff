//! The whole table: sources and events in rows, links in columns.

use std::time::Duration;

use jaus_test_kit::figures::Figures;

use super::cell::{Cell, Ending};
use super::link::Link;
use super::measurement::Measurement;
use super::operator::{Event, Source, Stop};
use super::{all_are_met, on_a_bed};

/// How often the operator stops the vehicle at once over each lossy link.
const STOPS: usize = 200;
/// The latest that one stop in 100 acts.
const LATEST: Duration = Duration::from_secs(5);
/// How long the link has lost packets before: after some time it has ended most drives.
const LOSING: [Duration; 2] = [Duration::from_millis(300), Duration::from_secs(1)];
/// How long something is held before the operator stops the vehicle at once.
const HELD: [Duration; 2] = [Duration::from_secs(2), Duration::from_secs(12)];
/// Links of the table in its order.
const LINKS: [Link; 7] = Link::ALL;

/// A part of the table: measures it into its figures.
type Part = fn(&mut Measurement<'_>, &mut Figures, &mut Vec<Cell>);

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man keys"]
fn keys() {
    check("keys", |measurement, figures, cells| {
        events(Source::Keys, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man mouse"]
fn mouse() {
    check("mouse", |measurement, figures, cells| {
        events(Source::Mouse, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man touch"]
fn touch() {
    check("touch", |measurement, figures, cells| {
        events(Source::Touch, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man gamepad"]
fn gamepad() {
    check("gamepad", |measurement, figures, cells| {
        events(Source::Gamepad, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes ten minutes: .ci/dead-man stops"]
fn stops() {
    check("stops", emergency_stops);
}

#[test]
#[ignore = "takes five minutes: .ci/dead-man missions"]
fn missions() {
    check("missions", stopped_missions);
}

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man lossy"]
fn lossy() {
    check("lossy", |measurement, figures, cells| {
        repeated_stops(Link::LOSSY, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes a quarter of an hour: .ci/dead-man very_lossy"]
fn very_lossy() {
    check("very_lossy", |measurement, figures, cells| {
        repeated_stops(Link::VERY_LOSSY, measurement, figures, cells);
    });
}

#[test]
#[ignore = "takes five minutes: .ci/dead-man refused"]
fn refused() {
    check("refused", refusals);
}

/// Measures a part of the table, writes it if that is requested, and requires that every cell meets its limit.
fn check(name: &str, part: Part) {
    on_a_bed(|bed| {
        let command = format!(".ci/dead-man {name}");
        let mut figures = Figures::new(&format!("dead-man-{name}"), &command);
        let mut cells = Vec::new();
        part(&mut Measurement::new(bed), &mut figures, &mut cells);
        figures.finish();
        all_are_met(&cells);
    });
}

fn head(figures: &mut Figures, title: &str, what: &str) {
    let [a, b, c, d, e, f, g] = LINKS.map(|it| it.name);
    figures.table(title, [what, a, b, c, d, e, f, g]);
}

/// Measures a row: one cell for each link.
fn row(
    figures: &mut Figures,
    cells: &mut Vec<Cell>,
    name: &str,
    measure: impl FnMut(Link) -> Cell,
) {
    let measured = LINKS.map(measure);
    let [a, b, c, d, e, f, g] = measured.each_ref().map(ToString::to_string);
    figures.row([name, &a, &b, &c, &d, &e, &f, &g]);
    cells.extend(measured);
}

fn events(
    source: Source,
    measurement: &mut Measurement<'_>,
    figures: &mut Figures,
    cells: &mut Vec<Cell>,
) {
    let title = format!("Driving by hand: {}", source.name());
    head(figures, &title, "what happens");
    let happens = Event::ALL.into_iter().filter(|it| it.can_happen_to(source));
    for event in happens {
        row(figures, cells, event.name(), |link| {
            measurement.event(source, event, link)
        });
    }
}

fn emergency_stops(
    measurement: &mut Measurement<'_>,
    figures: &mut Figures,
    cells: &mut Vec<Cell>,
) {
    head(figures, "Driving by hand: emergency stop", "how");
    for held in HELD {
        for (source, stop, name) in [
            (Source::Keys, Stop::Escape, "Esc, a key held"),
            (Source::Touch, Stop::RedButton, "red button, the stick held"),
            (
                Source::Gamepad,
                Stop::PadButton,
                "B of the gamepad, it is held",
            ),
        ] {
            let name = format!("{name} for {} s", held.as_secs());
            row(figures, cells, &name, |link| {
                measurement.stop(source, stop, link, held)
            });
        }
    }
}

fn stopped_missions(
    measurement: &mut Measurement<'_>,
    figures: &mut Figures,
    cells: &mut Vec<Cell>,
) {
    head(figures, "Mission: emergency stop", "how");
    for (stop, name) in [(Stop::Escape, "Esc"), (Stop::RedButton, "red button")] {
        row(figures, cells, name, |link| {
            measurement.stop_mission(stop, link)
        });
    }
}

fn repeated_stops(
    link: Link,
    measurement: &mut Measurement<'_>,
    figures: &mut Figures,
    cells: &mut Vec<Cell>,
) {
    let title = format!("Emergency stop by Esc while a key is held, {STOPS} times");
    figures.table(
        &title,
        [
            "link",
            "in emergency: median",
            "p99",
            "limit of p99",
            "longest",
            "command zero: driven until then",
            "longest",
            "limit",
        ],
    );
    let measure = |stop| measurement.stop_while_losing(link, LOSING[stop % LOSING.len()]);
    let mut all: Vec<Cell> = (0..STOPS).map(measure).collect();
    all.sort_by_key(|it| it.emergency.unwrap_or(Duration::MAX));
    let nth = |index: usize| all[index].emergency.unwrap_or(Duration::MAX);
    let (median, p99, longest) = (nth(STOPS / 2), nth(STOPS * 99 / 100 - 1), nth(STOPS - 1));
    let driven: Vec<Duration> = all.iter().filter_map(time_of_stop).collect();
    let seconds = |time: Duration| format!("{:.2} s", time.as_secs_f64());
    figures.row([
        link.name,
        &seconds(median),
        &seconds(p99),
        &seconds(link.repeated_limit()),
        &seconds(longest),
        &driven.len().to_string(),
        &seconds(driven.iter().max().copied().unwrap_or_default()),
        &seconds(link.emergency_limit()),
    ]);
    for (rank, cell) in all.iter_mut().enumerate() {
        let is_counted = rank < STOPS * 99 / 100;
        let limit = if is_counted {
            link.repeated_limit()
        } else {
            LATEST
        };
        // Only one that is late counts against its cell.
        let after = cell.emergency.unwrap_or(Duration::MAX);
        cell.emergency = (after > limit).then_some(after);
    }
    assert!(!driven.is_empty(), "no stop came while something drove");
    cells.extend(all);
}

/// When the command was zero, if the vehicle was driven until the stop.
fn time_of_stop(cell: &Cell) -> Option<Duration> {
    match &cell.ending {
        Ending::Stopped(stopped) => {
            let zero = stopped.command.unwrap_or(Duration::MAX);
            (!zero.is_zero()).then_some(zero)
        }
        _ => None,
    }
}

fn refusals(measurement: &mut Measurement<'_>, figures: &mut Figures, cells: &mut Vec<Cell>) {
    figures.table(
        "Links that are too slow",
        [
            "source",
            "0.8 s",
            "1.5 s",
            "0.8 s while driving",
            "1.5 s while driving",
        ],
    );
    for source in Source::ALL {
        let measured = Link::REFUSED.map(|link| measurement.event(source, Event::Release, link));
        let [a, b, c, d] = measured.each_ref().map(ToString::to_string);
        figures.row([source.name(), &a, &b, &c, &d]);
        cells.extend(measured);
    }
}
