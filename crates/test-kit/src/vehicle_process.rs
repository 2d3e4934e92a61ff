//! `jaus vehicle` as a separate process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

/// A running vehicle; killed when dropped.
pub struct VehicleProcess {
    child: Child,
    /// Collects the lines after the introduction.
    reader: Option<JoinHandle<Vec<String>>>,
}

impl VehicleProcess {
    /// Starts the command, and waits for the vehicle's introduction.
    pub fn start(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut vehicle = Self {
            child,
            reader: None,
        };
        let mut introduction = String::new();
        while !introduction.contains("Ctrl-C") {
            let read = stdout.read_line(&mut introduction).unwrap();
            assert_ne!(read, 0, "the vehicle has ended: {introduction}");
        }
        // The vehicle may print more lines.
        let lines = move || stdout.lines().map_while(Result::ok).collect();
        vehicle.reader = Some(std::thread::spawn(lines));
        vehicle
    }

    /// The number of its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal, by its name.
    pub fn signal(&self, name: &str) {
        let (signal, id) = (format!("-{name}"), self.child.id().to_string());
        let sent = Command::new("kill").args([&signal, &id]).status();
        assert!(sent.unwrap().success(), "{name} to {id}");
    }

    /// Stops it by SIGTERM; returns its output after the introduction.
    pub fn terminate(mut self) -> Vec<String> {
        self.signal("TERM");
        let lines = self.reader.take().unwrap().join().unwrap();
        assert!(self.child.wait().unwrap().success());
        lines
    }
}

impl Drop for VehicleProcess {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
