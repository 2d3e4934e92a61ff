//! Warden process that briefly outlives a killed `jaus up`: it knows the process group of every
//! part, and ends what is left when the pipe from `jaus up` breaks.
//!
//! The kernel has signalled the parts themselves by then ([`leash`](super::leash)); the warden ends
//! their descendants, and parts that ignore the signal.

use std::collections::BTreeSet;
use std::io::{self, BufRead, PipeWriter, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::runtime;
use nix::sys::signal::{SigSet, Signal, killpg};
use nix::unistd::Pid;

use super::leash;

/// Name of the subcommand.
pub(crate) const NAME: &str = "up-warden";

/// End process groups when standard input ends (internal to `jaus up`)
#[derive(Args)]
pub(crate) struct Warden {
    /// The time limit before they are killed
    #[arg(value_parser = runtime::duration)]
    grace: Duration,
}

/// Interval of checks for remaining processes.
const LOOK: Duration = Duration::from_millis(50);

impl Warden {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        // A signal to the whole group that ends `jaus up` must not end the warden first.
        let deaf = SigSet::from_iter([Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP]);
        deaf.thread_block().map_err(Failure::of)?;
        let mut groups = BTreeSet::new();
        for line in io::stdin().lock().lines().map_while(Result::ok) {
            note(&mut groups, &line);
        }
        signal_all(&groups, Signal::SIGTERM);
        let mut left = self.grace;
        while !left.is_zero() && groups.iter().any(|&group| exists(group)) {
            let pause = left.min(LOOK);
            #[expect(clippy::disallowed_methods, reason = "this process is single-threaded")]
            std::thread::sleep(pause);
            left -= pause;
        }
        signal_all(&groups, Signal::SIGKILL);
        Ok(Outcome::Done)
    }
}

/// Parses `+1234` or `-1234`.
fn note(groups: &mut BTreeSet<i32>, line: &str) {
    let Ok(number) = line.parse::<i32>() else {
        return;
    };
    // 0 would be our own group, and 1 all processes.
    match number {
        2.. => _ = groups.insert(number),
        _ => _ = groups.remove(&number.saturating_neg()),
    }
}

fn signal_all(groups: &BTreeSet<i32>, signal: Signal) {
    for &group in groups {
        // An error means that it has ended.
        let _ = killpg(Pid::from_raw(group), signal);
    }
}

fn exists(group: i32) -> bool {
    killpg(Pid::from_raw(group), None).is_ok()
}

/// Handle of the warden in `jaus up`.
pub(super) struct Guard {
    process: Child,
    pipe: PipeWriter,
}

impl Guard {
    /// Starts a warden.
    ///
    /// # Errors
    /// An error of the operating system.
    pub(super) fn start(grace: Duration) -> io::Result<Self> {
        let (reader, pipe) = io::pipe()?;
        let process = Command::new(leash::PROGRAM)
            .arg0("jaus")
            .args([NAME, &format!("{}s", grace.as_secs_f64())])
            .stdin(reader)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            // Ctrl-C must not reach it.
            .process_group(0)
            .spawn()?;
        Ok(Self { process, pipe })
    }

    /// Registers a started group.
    pub(super) fn guard(&mut self, group: Pid) {
        self.tell(format_args!("+{group}\n"));
    }

    /// Removes a group that has ended.
    pub(super) fn release(&mut self, group: Pid) {
        self.tell(format_args!("-{group}\n"));
    }

    fn tell(&mut self, line: std::fmt::Arguments<'_>) {
        // The owner notices a dead warden and replaces it by one that knows all groups.
        let _ = self.pipe.write_all(line.to_string().as_bytes());
    }

    /// Whether it has ended.
    pub(super) fn has_ended(&mut self) -> bool {
        !matches!(self.process.try_wait(), Ok(None))
    }

    /// Dismisses the warden.
    pub(super) fn dismiss(self) {
        let Self { mut process, pipe } = self;
        drop(pipe);
        // It exits by itself, because no group is left.
        let _ = process.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_come_and_go_and_nothing_else_is_taken_for_one() {
        let mut groups = BTreeSet::new();
        for line in [
            "+12",
            "+13",
            "-12",
            "+1",
            "+0",
            "-1",
            "",
            "x",
            "+99999999999",
        ] {
            note(&mut groups, line);
        }
        assert_eq!(groups, BTreeSet::from([13]));
    }
}
