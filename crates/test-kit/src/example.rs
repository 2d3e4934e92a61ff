//! The workspace's examples, each as a separate process.
//!
//! `cargo test` builds them. To run one of their tests alone, run `cargo build --examples` first.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use crate::waiting::LIMIT;

/// A running example; killed when dropped.
pub struct Example {
    name: &'static str,
    program: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    seen: Vec<String>,
}

impl Example {
    /// Starts an example.
    pub fn start(name: &'static str) -> Self {
        Self::start_with(name, &[])
    }

    /// Starts an example with arguments.
    pub fn start_with(name: &'static str, arguments: &[&str]) -> Self {
        let mut command = Command::new(path(name));
        command.args(arguments);
        Self::start_command(name, command)
    }

    /// Starts an example that is not one of cargo's, for instance in another language.
    pub fn start_command(name: &'static str, mut command: Command) -> Self {
        let mut program = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{name}: {error}; run cargo build --examples"));
        let output = BufReader::new(program.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                // The test may be over.
                let _ = sender.send(line);
            }
        });
        Self {
            name,
            input: program.stdin.take(),
            program,
            lines,
            seen: Vec::new(),
        }
    }

    /// Writes to its standard input.
    pub fn feed(&mut self, octets: &[u8]) {
        self.input.as_mut().unwrap().write_all(octets).unwrap();
    }

    /// Waits until it prints a line that contains this text.
    pub fn expect(&mut self, wanted: &str) {
        self.expect_line(wanted, |line| line.contains(wanted));
    }

    /// Waits until it prints a line of which this is true.
    pub fn expect_line(&mut self, wanted: &str, is_wanted: impl Fn(&str) -> bool) {
        let end = Instant::now() + LIMIT;
        while self.seen.last().is_none_or(|line| !is_wanted(line)) {
            let left = end.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) => self.seen.push(line),
                Err(_) => panic!("{} did not print {wanted:?}: {:#?}", self.name, self.seen),
            }
        }
    }

    /// The lines that it has printed, up to the last expected one.
    pub fn seen(&self) -> &[String] {
        &self.seen
    }

    /// Ends it as Ctrl-C does.
    pub fn interrupt(&mut self) -> ExitStatus {
        self.signal("INT");
        self.end()
    }

    /// Sends it a signal, such as `STOP`.
    pub fn signal(&self, signal: &str) {
        let id = self.program.id().to_string();
        let sent = Command::new("kill")
            .args([&format!("-{signal}"), &id])
            .status();
        assert!(sent.unwrap().success(), "SIG{signal} to {}", self.name);
    }

    /// Waits until it has ended.
    pub fn end(&mut self) -> ExitStatus {
        self.program.wait().unwrap()
    }
}

impl Drop for Example {
    fn drop(&mut self) {
        // It may have exited already.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Whether an example was built: some need a feature.
pub fn is_built(name: &str) -> bool {
    path(name).exists()
}

/// An example of the library, or the program of an example that is a package.
fn path(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().and_then(|deps| deps.parent()).unwrap();
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let example = profile.join("examples").join(&file);
    match example.exists() {
        true => example,
        false => profile.join(file),
    }
}
