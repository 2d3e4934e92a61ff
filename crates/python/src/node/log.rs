//! The library's log, which goes to Python's `logging` on a thread of its own: the thread of a node never
//! waits for the interpreter.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError};

use jaus_binding::lock;
use pyo3::prelude::*;
use tracing::{Level, Metadata};
use tracing_subscriber::Registry;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::{self, MakeWriter};
use tracing_subscriber::prelude::*;
use tracing_subscriber::reload::{self, Handle};

use super::failure::Failure;

/// Passes the log on to a function, `function(level, text)`, from this level of `logging` on. The first
/// call starts that, later ones change the level.
#[pyfunction]
pub(crate) fn set_log(function: Py<PyAny>, level: u8) -> PyResult<()> {
    static FILTER: OnceLock<Handle<LevelFilter, Registry>> = OnceLock::new();
    let level = match level {
        0..=10 => LevelFilter::DEBUG,
        11..=20 => LevelFilter::INFO,
        21..=30 => LevelFilter::WARN,
        _ => LevelFilter::ERROR,
    };
    if let Some(filter) = FILTER.get() {
        // It fails only when there is no log any more.
        let _ = filter.modify(|it| *it = level);
        return Ok(());
    }
    let (filter, handle) = reload::Layer::new(level);
    let lines = Arc::<Lines>::default();
    let layer = fmt::layer()
        .with_ansi(false)
        .without_time()
        .with_level(false)
        .with_target(false)
        .with_writer(Writer(lines.clone()))
        .with_filter(filter);
    // Another log of this process stays.
    if tracing_subscriber::registry()
        .with(layer)
        .try_init()
        .is_ok()
        && FILTER.set(handle).is_ok()
    {
        let thread = std::thread::Builder::new().name("jaus-log".to_owned());
        let thread = thread.spawn(move || lines.pass_on(&function));
        thread.map_err(|error| Failure::of("StartError", &error))?;
    }
    Ok(())
}

/// Lines that wait for the program.
#[derive(Default)]
struct Lines {
    waiting: Mutex<VecDeque<Line>>,
    added: Condvar,
}

struct Line {
    /// As in Python's `logging`.
    level: u8,
    text: Vec<u8>,
}

impl Lines {
    /// Limit of lines that wait. The newest are dropped: the first ones say what has begun.
    const MOST: usize = 1024;

    fn add(&self, line: Line) {
        let mut waiting = lock(&self.waiting);
        if waiting.len() < Self::MOST {
            waiting.push_back(line);
            self.added.notify_one();
        }
    }

    /// Passes lines on until the interpreter ends.
    fn pass_on(&self, function: &Py<PyAny>) {
        loop {
            let line = self.next();
            let text = String::from_utf8_lossy(&line.text);
            let text = jaus_text::visible(text.trim_end());
            let passed = Python::try_attach(|py| {
                if let Err(error) = function.call1(py, (line.level, text)) {
                    error.write_unraisable(py, None);
                }
            });
            if passed.is_none() {
                return;
            }
        }
    }

    fn next(&self) -> Line {
        let mut waiting = lock(&self.waiting);
        loop {
            if let Some(line) = waiting.pop_front() {
                return line;
            }
            let waited = self.added.wait(waiting);
            waiting = waited.unwrap_or_else(PoisonError::into_inner);
        }
    }
}

struct Writer(Arc<Lines>);

/// Collects one line.
struct LineWriter {
    lines: Arc<Lines>,
    line: Line,
}

impl<'a> MakeWriter<'a> for Writer {
    type Writer = LineWriter;

    fn make_writer(&'a self) -> LineWriter {
        self.line(20)
    }

    fn make_writer_for(&'a self, about: &Metadata<'_>) -> LineWriter {
        let level = match *about.level() {
            Level::ERROR => 40,
            Level::WARN => 30,
            Level::INFO => 20,
            Level::DEBUG | Level::TRACE => 10,
        };
        self.line(level)
    }
}

impl Writer {
    fn line(&self, level: u8) -> LineWriter {
        let line = Line {
            level,
            text: Vec::new(),
        };
        let lines = self.0.clone();
        LineWriter { lines, line }
    }
}

impl Write for LineWriter {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.line.text.extend_from_slice(text);
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for LineWriter {
    fn drop(&mut self) {
        let text = std::mem::take(&mut self.line.text);
        let level = self.line.level;
        self.lines.add(Line { level, text });
    }
}
