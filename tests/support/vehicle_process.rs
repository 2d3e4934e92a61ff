//! `jaus vehicle` in a process of its own.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A running vehicle; killed when dropped.
pub(crate) struct VehicleProcess(Child);

impl VehicleProcess {
    /// Starts what the command says, and waits until the vehicle is there.
    pub(crate) fn start(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let vehicle = Self(child);
        let mut introduction = String::new();
        while !introduction.contains("Ctrl-C") {
            let read = stdout.read_line(&mut introduction).unwrap();
            assert_ne!(read, 0, "the vehicle has ended: {introduction}");
        }
        // It may go on talking.
        std::thread::spawn(move || stdout.lines().map_while(Result::ok).for_each(drop));
        vehicle
    }
}

impl Drop for VehicleProcess {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
