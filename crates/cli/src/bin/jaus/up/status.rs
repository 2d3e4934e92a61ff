//! System status for other programs: a JSON file that is replaced atomically at every change.

use std::path::PathBuf;

use jaus_files::{Readers, replace};
use serde_json::{Value as Json, json};

use super::supervisor::{Exit, State};
use super::system::Part;

/// The status file with its content.
pub(super) struct StatusFile {
    path: PathBuf,
    written: Json,
    /// Whether the last update failed.
    failed: bool,
}

impl StatusFile {
    pub(super) const fn new(path: PathBuf) -> Self {
        Self {
            path,
            written: Json::Null,
            failed: false,
        }
    }

    /// Writes the status of the parts if it has changed. Reports a failure once.
    pub(super) fn update(&mut self, parts: &[Json]) -> Option<String> {
        let status = json!({ "supervisor": std::process::id(), "parts": parts });
        if status == self.written {
            return None;
        }
        let text = format!("{status:#}\n");
        match replace(&self.path, Readers::Everyone, text.as_bytes()) {
            Ok(()) => {
                self.written = status;
                self.failed = false;
                None
            }
            Err(_) if std::mem::replace(&mut self.failed, true) => None,
            Err(error) => Some(format!("--status {}: {error}", self.path.display())),
        }
    }
}

/// Status of one part.
pub(super) fn of_part(
    part: &Part,
    state: State,
    starts: u32,
    last: Option<Exit>,
    process: Option<i32>,
) -> Json {
    json!({
        "name": part.name,
        "program": part.program.display().to_string(),
        "state": match state {
            State::Waiting { .. } => "waiting",
            State::Starting => "starting",
            State::Running { .. } => "running",
            State::Stopping { .. } => "stopping",
            State::Ended => "ended",
            State::GivenUp => "given up",
            State::Stopped => "stopped",
        },
        "process": process,
        "starts": starts,
        "last_end": last.map(in_words),
    })
}

/// Describes the exit of a process.
pub(super) fn in_words(exit: Exit) -> String {
    use nix::sys::signal::Signal;
    match exit {
        Exit::Status(status) => format!("status {status}"),
        Exit::Signal(number) => match Signal::try_from(number) {
            Ok(signal) => signal.to_string(),
            Err(_) => format!("signal {number}"),
        },
        Exit::NotStarted => "not started".to_owned(),
    }
}
