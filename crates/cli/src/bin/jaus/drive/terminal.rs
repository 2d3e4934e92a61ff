//! The terminal of the drive: its keys without Enter, and its usual mode again at the end.
use std::io::{self, IsTerminal, Read};

use jaus_cli::failure::Failure;
use nix::sys::termios::{LocalFlags, SetArg, Termios, tcgetattr, tcsetattr};
use tokio::sync::mpsc;

/// Restores the terminal's mode when it is dropped.
pub(super) struct Mode {
    before: Option<Termios>,
}

impl Mode {
    /// Passes each key on at once and without echo, if standard input is a terminal.
    pub(super) fn by_key() -> Result<Self, Failure> {
        let stdin = io::stdin();
        if !stdin.is_terminal() {
            return Ok(Self { before: None });
        }
        let failure = |error| Failure::new(format!("cannot set the terminal's mode: {error}"));
        let before = tcgetattr(&stdin).map_err(failure)?;
        let mut mode = before.clone();
        mode.local_flags
            .remove(LocalFlags::ICANON | LocalFlags::ECHO);
        tcsetattr(&stdin, SetArg::TCSANOW, &mode).map_err(failure)?;
        Ok(Self {
            before: Some(before),
        })
    }

    /// Whether standard input is a terminal.
    pub(super) const fn is_terminal(&self) -> bool {
        self.before.is_some()
    }
}

impl Drop for Mode {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            // The terminal may be gone.
            let _ = tcsetattr(io::stdin(), SetArg::TCSANOW, before);
        }
    }
}

/// The octets of standard input. The channel closes at its end, also when the terminal is lost.
pub(super) fn octets() -> mpsc::UnboundedReceiver<u8> {
    let (octets, keys) = mpsc::unbounded_channel();
    // A thread of its own, because the runtime would wait for a read at its end.
    std::thread::spawn(move || {
        let mut buffer = [0; 64];
        while let Ok(count @ 1..) = io::stdin().lock().read(&mut buffer) {
            for &octet in &buffer[..count] {
                if octets.send(octet).is_err() {
                    return;
                }
            }
        }
    });
    keys
}
