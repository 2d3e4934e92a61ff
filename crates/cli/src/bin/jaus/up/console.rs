//! Console of a system: each line of a part, prefixed with the part's name. A terminal that does
//! not read blocks nothing: lines are dropped and counted.

use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use jaus_cli::failure::Failure;
use jaus_cli::output;
use jaus_text::shortened;
use tokio::sync::watch;

/// Maximum number of lines queued for a slow terminal.
const WAITING: usize = 4096;
/// Time limit for the remaining lines at the end.
const FAREWELL: Duration = Duration::from_secs(1);
/// Colours of the names, by their numbers (ECMA-48): neither red, nor black or white.
const COLOURS: [u8; 10] = [36, 33, 32, 35, 34, 96, 93, 92, 95, 94];

/// Sender of lines to the terminal. Cheap to clone.
#[derive(Clone)]
pub(super) struct Console {
    lines: SyncSender<String>,
    lost: Arc<AtomicU64>,
    colours: bool,
    width: usize,
}

/// The printing thread.
pub(super) struct Printer {
    closed: watch::Receiver<bool>,
}

/// A console that prefixes lines with a name.
#[derive(Clone)]
pub(super) struct PrefixedConsole {
    console: Console,
    prefix: String,
}

impl Console {
    /// Starts the printing thread; `width` is the longest name.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub(super) fn start(width: usize) -> Result<(Self, Printer), Failure> {
        let (lines, waiting) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let (close, closed) = watch::channel(false);
        let counter = lost.clone();
        let print = move || {
            // An error means that the output is closed, and nothing is left to do.
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

    /// A console for this name; the number selects a colour. Without one it is `jaus up` itself.
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
    /// Prints a line in printable characters.
    pub(super) fn say(&self, line: &str) {
        self.console
            .line(format!("{}{}\n", self.prefix, printable(line)));
    }
}

/// A part's line, with escapes in place of what would disturb the terminal. Its reader has cut it.
fn printable(line: &str) -> String {
    shortened(&line.replace('\t', " "), usize::MAX).into_owned()
}

impl Printer {
    /// Waits until the output is closed.
    pub(super) async fn closed(&mut self) {
        // An error is the end of the printer, too.
        let _ = self.closed.wait_for(|closed| *closed).await;
    }

    /// Waits briefly until all lines are printed. All consoles must be dropped.
    #[expect(clippy::disallowed_methods, reason = "ends in real time")]
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
            writeln!(
                out,
                "({missing} lines were dropped: the reader was too slow)"
            )?;
        }
        out.write_all(line.as_bytes())?;
        for line in waiting.try_iter().take(if interactive { 0 } else { 64 }) {
            out.write_all(line.as_bytes())?;
        }
        out.flush()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_a_part_neither_moves_the_cursor_nor_reverses_the_text() {
        let shown = printable("a\tb\x1b[2J \u{202e}gpj.exe");
        assert_eq!(shown, r"a b\u{1b}[2J \u{202e}gpj.exe");
    }
}
