//! A running process: start, output, signals, and exit.
//!
//! It leads its own process group, so that its descendants end with it, and Ctrl-C reaches only
//! `jaus up`. [`leash`](super::leash) runs between the fork and the program.

use std::fs;
use std::io::{self, IsTerminal, PipeReader};
use std::os::fd::OwnedFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child as Process, Command, Stdio};

use jaus_cli::output::OUTPUT_IS_LOG;
use nix::errno::Errno;
use nix::sys::signal::{Signal, killpg};
use nix::sys::wait::{Id, WaitPidFlag, WaitStatus, waitid};
use nix::unistd::Pid;
use tokio::io::AsyncReadExt;
use tokio::net::unix::pipe;
use tokio::task::JoinHandle;

use super::console::PrefixedConsole;
use super::leash;
use super::supervisor::Exit;
use super::system::Part;

/// A process, until it is [reaped](Self::reap).
pub(super) struct Child {
    process: Process,
    group: Pid,
    listening: JoinHandle<()>,
}

impl Child {
    /// Starts a part; its output goes to the prefixed console.
    ///
    /// # Errors
    /// An error of the operating system.
    pub(super) fn start(part: &Part, prefixed_console: PrefixedConsole) -> io::Result<Self> {
        if let Some(directory) = &part.directory {
            fs::create_dir_all(directory)?;
        }
        let (reader, writer) = io::pipe()?;
        let mut command = Command::new(leash::PROGRAM);
        command
            .arg0("jaus")
            .args(leash::arguments())
            .arg(&part.program)
            .args(&part.arguments)
            .envs(part.environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(writer.try_clone()?)
            .stderr(writer)
            .process_group(0);
        if !io::stdout().is_terminal() {
            command.env(OUTPUT_IS_LOG, "1");
        }
        if let Some(directory) = &part.directory {
            command.current_dir(directory);
        }
        let listening = listen(reader, prefixed_console)?;
        let process = command.spawn().inspect_err(|_| listening.abort())?;
        let group = i32::try_from(process.id()).map(Pid::from_raw);
        Ok(Self {
            group: group.map_err(io::Error::other)?,
            process,
            listening,
        })
    }

    /// The process id, which is also its group.
    pub(super) const fn id(&self) -> Pid {
        self.group
    }

    /// Signals the process and all its descendants in the group.
    pub(super) fn signal(&self, signal: Signal) {
        // The process is not reaped, so its number is not reused; an error means that it and its
        // group have ended.
        if let Err(error) = killpg(self.group, signal)
            && error != Errno::ESRCH
        {
            tracing::debug!(group = %self.group, %signal, %error, "cannot signal the process \
                group");
        }
    }

    /// Whether the process has ended. Its number is not reused until it is [reaped](Self::reap).
    pub(super) fn has_ended(&self) -> bool {
        let look = WaitPidFlag::WEXITED | WaitPidFlag::WNOHANG | WaitPidFlag::WNOWAIT;
        !matches!(
            waitid(Id::Pid(self.group), look),
            Ok(WaitStatus::StillAlive) | Err(Errno::EINTR)
        )
    }

    /// Reaps a process that has ended: kills the rest of its group and prints its remaining output.
    pub(super) async fn reap(mut self) -> Exit {
        self.signal(Signal::SIGKILL);
        let exit = match self.process.wait() {
            Ok(status) => match (status.code(), status.signal()) {
                (Some(code), _) => Exit::Status(code),
                (None, Some(signal)) => Exit::Signal(signal),
                (None, None) => Exit::NotStarted,
            },
            Err(_) => Exit::NotStarted,
        };
        // A process that has left the group may keep the pipe open forever.
        #[expect(
            clippy::disallowed_methods,
            reason = "reads the last output in real time"
        )]
        let _ = tokio::time::timeout(LAST_WORDS, self.listening).await;
        exit
    }
}

const LAST_WORDS: std::time::Duration = std::time::Duration::from_millis(200);

/// Prints every line of a pipe.
#[expect(
    clippy::disallowed_methods,
    reason = "the command owns its tasks; this one ends with the pipe"
)]
fn listen(reader: PipeReader, prefixed_console: PrefixedConsole) -> io::Result<JoinHandle<()>> {
    let mut pipe = pipe::Receiver::from_owned_fd(OwnedFd::from(reader))?;
    Ok(tokio::spawn(async move {
        let mut lines = Lines::default();
        let mut buffer = vec![0; Lines::LONGEST];
        while let Ok(length @ 1..) = pipe.read(&mut buffer).await {
            let octets = buffer.get(..length).unwrap_or_default();
            lines.take(octets, &prefixed_console);
        }
        lines.end(&prefixed_console);
    }))
}

/// Splits octets into lines.
#[derive(Default)]
struct Lines {
    begun: Vec<u8>,
}

impl Lines {
    /// Longer lines are split.
    const LONGEST: usize = 4096;

    fn take(&mut self, octets: &[u8], prefixed_console: &PrefixedConsole) {
        for mut piece in octets.split_inclusive(|&octet| octet == b'\n') {
            while !piece.is_empty() {
                let room = Self::LONGEST.saturating_sub(self.begun.len());
                let (fits, rest) = piece.split_at(room.clamp(1, piece.len()));
                self.begun.extend_from_slice(fits);
                if fits.ends_with(b"\n") || self.begun.len() >= Self::LONGEST {
                    self.end(prefixed_console);
                }
                piece = rest;
            }
        }
    }

    fn end(&mut self, prefixed_console: &PrefixedConsole) {
        let line = self.begun.strip_suffix(b"\n").unwrap_or(&self.begun);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if !self.begun.is_empty() {
            prefixed_console.say(&String::from_utf8_lossy(line));
        }
        self.begun.clear();
    }
}
