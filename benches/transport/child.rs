//! Child processes: this program again, in a role.

use std::env;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::placement;
use crate::roles::Role;
use crate::run;

/// A running child process; killed when dropped.
pub(crate) struct Process {
    child: Child,
    /// The line that it prints when ready, such as an address.
    pub(crate) ready: String,
}

impl Process {
    /// Starts a child on these processors and waits until it is ready.
    pub(crate) fn start(role: &Role, processors: &[usize]) -> Self {
        let processors: Vec<_> = processors.iter().map(usize::to_string).collect();
        let this = env::current_exe().expect("the path of this program");
        let mut child = Command::new(this)
            .env(Role::VARIABLE, role.to_words())
            .env(placement::VARIABLE, processors.join(","))
            .env(run::VARIABLE, run::number().to_string())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a child process");
        let output = child.stdout.take().expect("its output is piped");
        let mut ready = String::new();
        BufReader::new(output)
            .read_line(&mut ready)
            .expect("a line from the child");
        assert!(!ready.is_empty(), "the child {role:?} exited at once");
        Self {
            child,
            ready: ready.trim().to_owned(),
        }
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// CPU time used so far.
    pub(crate) fn processor_time(&self) -> Duration {
        let stat = std::fs::read_to_string(format!("/proc/{}/schedstat", self.id()));
        let stat = stat.expect("Linux");
        let nanoseconds = stat.split(' ').next().and_then(|word| word.parse().ok());
        Duration::from_nanos(nanoseconds.expect("nanoseconds"))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have exited already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
