//! The story of the trial that runs on this thread: it is told when the trial fails, because the random
//! numbers that the programs draw by themselves may make the next trial of the same seed another one.

use std::cell::RefCell;
use std::time::Duration;

use crate::seeds;

thread_local! {
    static STORY: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// The lines that are told at most.
const LAST: usize = 80;

pub(crate) fn begin() {
    STORY.with_borrow_mut(Vec::clear);
}

/// Notes an event, and prints it if the trial is traced.
pub(crate) fn note(now: Duration, what: &str) {
    let line = format!("{:>9.3} {what}", now.as_secs_f64());
    if seeds::is_traced() {
        eprintln!("{line}");
    }
    STORY.with_borrow_mut(|story| story.push(line));
}

/// The end of the story.
pub(crate) fn tell() -> String {
    STORY.with_borrow(|story| story[story.len().saturating_sub(LAST)..].join("\n"))
}
