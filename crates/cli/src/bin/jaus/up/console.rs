//! What people see of a system: a line for each line of a part, with the part's name in front. A
//! terminal that does not read holds nobody up: lines are lost then, and counted.

use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use jaus_cli::failure::Failure;
use jaus_cli::output;
use tokio::sync::watch;

/// Lines that may wait for a slow terminal.
const WAITING: usize = 4096;
/// How long it may take to print what is left at the end.
const FAREWELL: Duration = Duration::from_secs(1);
/// Colours for the names, by their numbers (ECMA-48): neither red, nor black or white.
const COLOURS: [u8; 10] = [36, 33, 32, 35, 34, 96, 93, 92, 95, 94];

/// The way to the terminal. Cheap to clone.
#[derive(Clone)]
pub(super) struct Console {
    lines: SyncSender<String>,
    lost: Arc<AtomicU64>,
    colours: bool,
    width: usize,
}

/// The thread that prints.
pub(super) struct Printer {
    closed: watch::Receiver<bool>,
}

/// One who speaks.
#[derive(Clone)]
pub(super) struct PrefixedConsole {
    console: Console,
    prefix: String,
}

impl Console {
    /// Begins to print for speakers whose names are at most so long.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub(super) fn start(width: usize) -> Result<(Self, Printer), Failure> {
        let (lines, waiting) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let (close, closed) = watch::channel(false);
        let counter = lost.clone();
        let print = move || {
            // An error means that nobody reads any more, and then nothing is left to do.
            let _ = print(&waiting, &counter);
            close.send_replace(true);
        };
        std::thread::Builder::new()
            .name("console".to_owned())
            .spawn(print)
            .map_err(|error| Failure::new(format!("cannot start: {error}")))?;
        let console = Self {
            lines,
            lost,
            colours: output::colours_wanted(&io::stdout()),
            width,
        };
        Ok((console, Printer { closed }))
    }

    /// Somebody who may speak; the number chooses a colour. Without one it is `jaus up` itself.
    pub(super) fn prefixed_console(&self, name: &str, number: Option<usize>) -> PrefixedConsole {
        let width = self.width;
        let plain = format!("{name:width$} | ");
        let colour = number.map_or(Some(&1), |number| COLOURS.get(number % COLOURS.len()));
        let prefix = match colour.filter(|_| self.colours) {
            Some(colour) => format!("\x1b[{colour}m{plain}\x1b[0m"),
            None => plain,
        };
        PrefixedConsole {
            console: self.clone(),
            prefix,
        }
    }

    fn line(&self, line: String) {
        match self.lines.try_send(line) {
            Ok(()) => {}
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.lost.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

impl PrefixedConsole {
    /// Says a line; control characters in it are made visible.
    pub(super) fn say(&self, line: &str) {
        let visible: String = line.chars().map(visible).collect();
        self.console.line(format!("{}{visible}\n", self.prefix));
    }
}

/// What may drive a terminal is shown instead.
fn visible(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        c => c,
    }
}

impl Printer {
    /// Waits until nobody reads any more.
    pub(super) async fn closed(&mut self) {
        // An error is the end of the printer, too.
        let _ = self.closed.wait_for(|closed| *closed).await;
    }

    /// Waits until all is printed, for a moment at most. Everybody who can speak must be gone.
    #[expect(clippy::disallowed_methods, reason = "a farewell in real time")]
    pub(super) async fn finish(mut self) {
        let _ = tokio::time::timeout(FAREWELL, self.closed()).await;
    }
}

fn print(waiting: &Receiver<String>, lost: &AtomicU64) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let interactive = out.is_terminal();
    while let Ok(line) = waiting.recv() {
        let missing = lost.swap(0, Ordering::Relaxed);
        if missing > 0 {
            writeln!(out, "({missing} lines are lost: nobody read them in time)")?;
        }
        out.write_all(line.as_bytes())?;
        for line in waiting.try_iter().take(if interactive { 0 } else { 64 }) {
            out.write_all(line.as_bytes())?;
        }
        out.flush()?;
    }
    Ok(())
}
