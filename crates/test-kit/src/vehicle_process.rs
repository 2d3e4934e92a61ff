//! `jaus vehicle` as a separate process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use crate::waiting::block_until;

/// A running vehicle; killed when dropped.
pub struct VehicleProcess {
    child: Child,
    /// Output after the introduction.
    lines: Arc<Mutex<Vec<String>>>,
    reader: Option<JoinHandle<()>>,
}

impl VehicleProcess {
    /// Starts the command, and waits for the vehicle's introduction.
    pub fn start(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut vehicle = Self {
            child,
            lines: Arc::default(),
            reader: None,
        };
        let mut introduction = String::new();
        while !introduction.contains("Ctrl-C") {
            let read = stdout.read_line(&mut introduction).unwrap();
            assert_ne!(read, 0, "the vehicle has ended: {introduction}");
        }
        let lines = vehicle.lines.clone();
        vehicle.reader = Some(std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                lines.lock().unwrap().push(line);
            }
        }));
        vehicle
    }

    /// The process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal, by its name.
    pub fn signal(&self, name: &str) {
        let (signal, id) = (format!("-{name}"), self.child.id().to_string());
        let sent = Command::new("kill").args([&signal, &id]).status();
        assert!(sent.unwrap().success(), "{name} to {id}");
    }

    /// Waits until it has printed a line that contains this text, after its introduction.
    pub fn says(&self, text: &str) {
        block_until(|| {
            let lines = self.lines.lock().unwrap();
            lines.iter().any(|line| line.contains(text))
        });
    }

    /// Stops it by SIGTERM; returns its output after the introduction.
    pub fn terminate(mut self) -> Vec<String> {
        self.signal("TERM");
        self.reader.take().unwrap().join().unwrap();
        assert!(self.child.wait().unwrap().success());
        std::mem::take(&mut *self.lines.lock().unwrap())
    }
}

impl Drop for VehicleProcess {
    fn drop(&mut self) {
        // It may have exited already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
