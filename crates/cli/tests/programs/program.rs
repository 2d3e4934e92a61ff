//! A single-component program as a process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use jaus_test_kit::waiting::LIMIT;

/// A running program and its standard error.
pub(crate) struct Program {
    child: Child,
    lines: Receiver<String>,
}

impl Program {
    pub(crate) fn start(flags: &[&str], environment: &[(&str, &str)]) -> Self {
        let driver = env!("CARGO_BIN_EXE_jaus-primitive-driver");
        Self::start_as(driver, flags, environment)
    }

    pub(crate) fn start_as(program: &str, flags: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut command = Command::new(program);
        command.arg("--loopback").args(flags).stderr(Stdio::piped());
        command.stdout(Stdio::piped());
        command.env_remove("JAUS_LOG");
        command.envs(environment.iter().copied());
        let mut child = command.spawn().unwrap();
        let errors = BufReader::new(child.stderr.take().unwrap());
        let (tell, lines) = channel();
        std::thread::spawn(move || {
            for line in errors.lines().map_while(Result::ok) {
                let _ = tell.send(line);
            }
        });
        Self { child, lines }
    }

    pub(crate) fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &id]).status();
        assert!(sent.unwrap().success());
    }

    /// Waits for a line with this text, and returns all lines up to it.
    pub(crate) fn says(&self, text: &str) -> String {
        let mut said = String::new();
        while let Ok(line) = self.lines.recv_timeout(LIMIT) {
            said += &(line + "\n");
            if said.contains(text) {
                return said;
            }
        }
        panic!("it does not say \"{text}\": {said}");
    }

    /// Waits until it has ended by itself. Returns its exit status.
    pub(crate) fn ends(&mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }

    /// The first line of its standard output, or all of it if that has no line.
    pub(crate) fn prints(&mut self) -> String {
        let mut line = String::new();
        let output = self.child.stdout.take().unwrap();
        BufReader::new(output).read_line(&mut line).unwrap();
        line
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
