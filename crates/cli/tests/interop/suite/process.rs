//! Processes of the parties in their namespaces: their output is kept in a file and can be waited
//! for, and they end with all their children.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;

/// How long a process may take to end when it is asked to.
const FAREWELL: Duration = Duration::from_secs(2);
/// Between two looks at a process that is to end.
const LOOK: Duration = Duration::from_millis(10);

/// A process in a namespace; killed with its children when dropped.
#[derive(Debug)]
pub(crate) struct Process {
    name: String,
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
}

impl Process {
    /// Starts a command in a namespace. What it says goes to the end of the file `log`, too.
    pub(crate) fn start(namespace: &str, command: &[String], log: &Path) -> Result<Self, String> {
        let name = short(command);
        let wrong = |error| format!("`{name}` could not be started: {error}");
        let mut file = File::options()
            .create(true)
            .append(true)
            .open(log)
            .map_err(wrong)?;
        writeln!(file, "$ {}", command.join(" ")).map_err(wrong)?;
        let mut child = Command::new("ip")
            .args(["netns", "exec", namespace])
            .args(command)
            .env_remove("JAUS_LOG")
            .process_group(0)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(wrong)?;
        let (sender, lines) = channel();
        let file = Arc::new(Mutex::new(file));
        if let Some(stdout) = child.stdout.take() {
            listen(stdout, sender.clone(), file.clone());
        }
        if let Some(stderr) = child.stderr.take() {
            listen(stderr, sender, file);
        }
        Ok(Self {
            name,
            child,
            lines,
            said: Vec::new(),
        })
    }

    /// Waits until it says a line with this in it, from now on.
    pub(crate) fn says(&mut self, what: &str, within: Duration) -> Result<(), String> {
        let deadline = Instant::now() + within;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) => {
                    let is_it = line.contains(what);
                    self.said.push(line);
                    if is_it {
                        return Ok(());
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    let seconds = within.as_secs();
                    return Err(self.complaint(&format!("did not say `{what}` within {seconds} s")));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(self.complaint(&format!("ended before it said `{what}`")));
                }
            }
        }
    }

    /// Forgets what it has said until now.
    pub(crate) fn forget(&mut self) {
        while let Ok(line) = self.lines.try_recv() {
            self.said.push(line);
        }
    }

    /// Waits until it ends by itself, and gives what it has said; an error if it failed.
    pub(crate) fn ends(mut self, within: Duration) -> Result<String, String> {
        let deadline = Instant::now() + within;
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if Instant::now() >= deadline => {
                    let seconds = within.as_secs();
                    self.forget();
                    return Err(self.complaint(&format!("did not end within {seconds} s")));
                }
                Ok(None) => std::thread::sleep(LOOK),
                Err(error) => return Err(format!("`{}`: {error}", self.name)),
            }
        };
        // Until both ends are closed, unless a surviving child holds them open.
        while let Ok(line) = self.lines.recv_timeout(FAREWELL) {
            self.said.push(line);
        }
        if status.success() {
            return Ok(self.said.join("\n"));
        }
        Err(self.complaint(&in_words(status)))
    }

    /// Whether it ended unexpectedly.
    pub(crate) fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }

    /// What it has to do with a failure: the last thing it said.
    fn complaint(&self, what: &str) -> String {
        let last = self.said.iter().rev().find(|line| !line.trim().is_empty());
        let last = last.map_or_else(
            || "it said nothing".to_owned(),
            |line| format!("the last thing it said: {}", line.trim()),
        );
        format!("`{}` {what}; {last}", self.name)
    }

    fn signal(&self, signal: Signal) {
        let Ok(group) = i32::try_from(self.child.id()) else {
            return;
        };
        // It may be gone.
        let _ = killpg(Pid::from_raw(group), signal);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.signal(Signal::SIGTERM);
        let deadline = Instant::now() + FAREWELL;
        while !self.has_ended() && Instant::now() < deadline {
            std::thread::sleep(LOOK);
        }
        // Children may remain in any case.
        self.signal(Signal::SIGKILL);
        let _ = self.child.wait();
    }
}

/// Passes on what a process says, line by line.
fn listen(from: impl Read + Send + 'static, to: Sender<String>, log: Arc<Mutex<File>>) {
    std::thread::spawn(move || {
        for line in BufReader::new(from).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line).into_owned();
            if let Ok(mut log) = log.lock() {
                // The log is for people; the test continues without it.
                let _ = writeln!(log, "{line}");
            }
            // The reader is gone, but the process must not block.
            let _ = to.send(line);
        }
    });
}

/// A command as people would call it: in one line, and without the place of its program.
fn short(command: &[String]) -> String {
    let Some((program, arguments)) = command.split_first() else {
        return String::new();
    };
    let program = Path::new(program);
    let is_ours = std::env::current_exe().is_ok_and(|own| own == program);
    let program = match program.file_name() {
        Some(name) if !is_ours => name.to_string_lossy().into_owned(),
        _ => "interop".to_owned(),
    };
    let words = std::iter::once(program).chain(arguments.iter().cloned());
    words.collect::<Vec<_>>().join(" ").replace('\n', "; ")
}

fn in_words(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("failed with status {code}"),
        None => format!("was killed ({status})"),
    }
}
