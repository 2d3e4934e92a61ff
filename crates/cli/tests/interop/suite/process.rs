//! Processes of the parties in their namespaces. Their output is kept in a file and can be waited
//! for; they end with all their children.

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

/// How long a process may take to end after it is asked to.
const FAREWELL: Duration = Duration::from_secs(2);
/// Polling interval while a process ends.
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
    /// Starts a command in a namespace. Its output is also appended to the file `log`.
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

    /// Waits for the next output line that contains `what`.
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

    /// Skips all output so far.
    pub(crate) fn forget(&mut self) {
        while let Ok(line) = self.lines.try_recv() {
            self.said.push(line);
        }
    }

    /// Waits until it ends by itself, and returns its output; an error if it failed.
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
        // Reads until both pipes are closed; a surviving child may hold them open.
        while let Ok(line) = self.lines.recv_timeout(FAREWELL) {
            self.said.push(line);
        }
        if status.success() {
            return Ok(self.said.join("\n"));
        }
        Err(self.complaint(&in_words(status)))
    }

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }

    /// An error text with the last line that it printed.
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
        // The process group may be gone.
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

/// Forwards the output of a process, line by line.
fn listen(from: impl Read + Send + 'static, to: Sender<String>, log: Arc<Mutex<File>>) {
    std::thread::spawn(move || {
        for line in BufReader::new(from).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line).into_owned();
            if let Ok(mut log) = log.lock() {
                // The log is only for readers; the test continues without it.
                let _ = writeln!(log, "{line}");
            }
            // The receiver may be gone, but the process must not block on a full pipe.
            let _ = to.send(line);
        }
    });
}

/// A command as a user would type it: in one line, and without the path of its program.
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
