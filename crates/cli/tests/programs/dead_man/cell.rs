//! A cell of the table: a source, what happened to it, the link, and how the motors stopped.

use std::fmt;
use std::time::Duration;

use super::link::{DEAD_MAN, Link};
use super::motor::Stopped;

/// How a cell ended.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ending {
    /// It was driven until the event, and stopped.
    Stopped(Stopped),
    /// It had stopped before the event, because the link had become worse: times are from then on.
    StoppedBefore(Stopped),
    /// It was never driven.
    Refused,
    /// It was not driven, but for this share of the time, 0 to 1.
    Jerks(f64),
    /// Every drive had ended before its event.
    NeverDriven,
    /// A mission that its operator has approved, and cannot reach any more.
    GoesOn,
}

/// A measured cell.
pub(crate) struct Cell {
    pub(crate) name: String,
    pub(crate) ending: Ending,
    pub(crate) limit: Duration,
    pub(crate) link: Link,
    /// Speed before the event over a free link, in m/s, at least.
    pub(crate) speed: f64,
    /// When an emergency stop of a vehicle that stood already was in force.
    pub(crate) emergency: Option<Duration>,
    /// What the page said about driving at the end.
    pub(crate) line: String,
}

impl Cell {
    /// Whether the motors stopped within the limit.
    pub(crate) fn is_met(&self) -> bool {
        let emergency_is_met = self.emergency.is_none_or(|it| it <= self.limit);
        let ending_is_met = match &self.ending {
            Ending::Stopped(stopped) => {
                !self.link.is_refused && self.has_moved(stopped) && is_within(stopped, self.limit)
            }
            Ending::StoppedBefore(stopped) => is_within(stopped, DEAD_MAN),
            Ending::Refused => self.link.is_refused,
            Ending::NeverDriven | Ending::Jerks(_) => false,
            Ending::GoesOn => true,
        };
        ending_is_met && emergency_is_met
    }

    /// Whether the vehicle was driven before the event: over a free link as fast as commanded, not in jerks.
    fn has_moved(&self, stopped: &Stopped) -> bool {
        !self.link.is_free() || stopped.speed >= self.speed
    }

    /// The motors' part of the cell.
    fn motors(&self) -> String {
        let (before, stopped) = match &self.ending {
            Ending::Refused => return "refused".to_owned(),
            Ending::Jerks(share) => return format!("driven for {:.0} %", 100.0 * share),
            Ending::NeverDriven => return "not driven".to_owned(),
            Ending::GoesOn => return "goes on, as approved".to_owned(),
            Ending::Stopped(stopped) => ("", stopped),
            Ending::StoppedBefore(stopped) => ("link: ", stopped),
        };
        let [command, rest] = [stopped.command, stopped.rest].map(seconds);
        let (speed, metres) = (stopped.speed, stopped.metres);
        format!("{before}{command}; {rest}, {speed:.1} m/s, {metres:.2} m")
    }
}

impl fmt::Display for Cell {
    /// For example `0.12 s; 0.40 s, 1.0 m/s, 0.25 m`: the command, then rest, speed and distance. A missed limit is bold.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let emergency = self
            .emergency
            .map(|it| format!("; emergency {}", seconds(Some(it))));
        let text = self.motors() + &emergency.unwrap_or_default();
        match self.is_met() {
            true => f.write_str(&text),
            false => write!(f, "**{text}**"),
        }
    }
}

fn is_within(stopped: &Stopped, limit: Duration) -> bool {
    stopped.command.is_some_and(|it| it <= limit)
}

fn seconds(time: Option<Duration>) -> String {
    time.map_or_else(
        || "never".to_owned(),
        |it| format!("{:.2} s", it.as_secs_f64()),
    )
}
