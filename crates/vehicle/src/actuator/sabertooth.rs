//! Sabertooth motor controllers on a serial line (Dimension Engineering, packetized serial).
//!
//! A packet has four octets: the controller's address (128 to 135), a command, a value from 0 to
//! 127, and the sum of these three modulo 128. The controller never answers, so the line shows
//! neither its faults nor the travel of the wheels.
//!
//! The controller is told to stop its motors when it receives nothing for 200 ms (its serial
//! timeout, command 14), so they stop even if the program is killed. It forgets this when its power
//! fails, so it is told every second.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use super::motor_thread::MotorLine;
use super::{MotorConfig, OpenLoopMotor};

impl OpenLoopMotor {
    /// Starts motors 1 and 2 of the Sabertooth controller with this address (128 to 135) on a serial
    /// line.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub fn sabertooth(
        line: impl Write + Send + 'static,
        address: u8,
        config: MotorConfig,
    ) -> io::Result<[Self; 2]> {
        let sabertooth = Sabertooth {
            line,
            address,
            set_up_at: None,
        };
        Self::start(sabertooth, config)
    }
}

/// The controller on its line.
struct Sabertooth<W> {
    line: W,
    address: u8,
    /// When the serial timeout was last set; `None` if it may be lost.
    set_up_at: Option<Instant>,
}

impl<W: Write + Send + 'static> MotorLine for Sabertooth<W> {
    const NAME: &'static str = "sabertooth";
    const PERIOD: Duration = Duration::from_millis(50);

    fn exchange(&mut self, now: Instant, shares: &[f64]) -> Result<(), String> {
        /// Interval between two settings of the serial timeout.
        const SETUP: Duration = Duration::from_secs(1);
        let since = |at| now.saturating_duration_since(at);
        let sets_up = self.set_up_at.is_none_or(|at| since(at) >= SETUP);
        let mut octets = Vec::new();
        if sets_up {
            octets.extend(packet(self.address, TIMEOUT, 2));
        }
        for (motor, &share) in shares.iter().enumerate() {
            octets.extend(drive(self.address, motor, share));
        }
        let written = self.line.write_all(&octets);
        match written.and_then(|()| self.line.flush()) {
            Ok(()) => {
                self.set_up_at = if sets_up { Some(now) } else { self.set_up_at };
                Ok(())
            }
            Err(error) => {
                self.set_up_at = None;
                Err(format!("cannot write to the motor controller: {error}"))
            }
        }
    }
}

/// Command: stop after this many tenths of a second without a packet.
const TIMEOUT: u8 = 14;

fn packet(address: u8, command: u8, value: u8) -> [u8; 4] {
    let sum = address.wrapping_add(command).wrapping_add(value);
    [address, command, value, sum & 0x7F]
}

/// Drives motor 0 or 1: commands 0 and 1 are forward and backward of the first, 4 and 5 of the
/// second.
fn drive(address: u8, motor: usize, share: f64) -> [u8; 4] {
    let first = if motor == 0 { 0 } else { 4 };
    let command = first + u8::from(share < 0.0);
    packet(address, command, (share.abs() * 127.0).round() as u8)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "the motors are served in real time"
)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex, mpsc};

    use crate::actuator::{Actuator, Command};

    /// A line that records the last packet of each command, and can break.
    #[derive(Clone, Default)]
    struct Line(Arc<Mutex<Record>>);

    #[derive(Default)]
    struct Record {
        packets: Vec<[u8; 4]>,
        is_broken: bool,
    }

    impl Line {
        /// The last values for both motors, backwards negative.
        fn last(&self) -> [i16; 2] {
            let record = self.0.lock().unwrap();
            [0, 4].map(|first| {
                let of_motor = |packet: &&[u8; 4]| [first, first + 1].contains(&packet[1]);
                let last = record.packets.iter().rfind(of_motor);
                last.map_or(0, |packet| match packet[1] == first {
                    true => i16::from(packet[2]),
                    false => -i16::from(packet[2]),
                })
            })
        }

        fn until(&self, wanted: [i16; 2], mut meanwhile: impl FnMut()) {
            let start = Instant::now();
            while self.last() != wanted {
                meanwhile();
                let last = self.last();
                assert!(start.elapsed() < Duration::from_secs(20), "{last:?}");
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    impl Write for Line {
        fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
            let mut record = self.0.lock().unwrap();
            if record.is_broken {
                return Err(io::Error::other("unplugged"));
            }
            let packets = octets.chunks(4).map(|it| <[u8; 4]>::try_from(it).unwrap());
            record.packets.extend(packets);
            Ok(octets.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn start() -> (Line, [OpenLoopMotor; 2]) {
        let line = Line::default();
        let motors = OpenLoopMotor::sabertooth(line.clone(), 130, MotorConfig::default()).unwrap();
        (line, motors)
    }

    const fn ahead(drive: f64) -> Command {
        Command { drive, brake: 0.0 }
    }

    #[test]
    fn a_packet_is_that_of_the_manual() {
        // The example of the manual: address 130, forward, half speed.
        assert_eq!(packet(130, 0, 64), [130, 0, 64, 66]);
        assert_eq!(
            drive(128, 1, -1.0),
            [128, 5, 127, (128 + 5 + 127 - 256) as u8 & 0x7F]
        );
    }

    #[test]
    fn both_motors_turn_as_commanded_and_the_controller_has_a_timeout() {
        let (line, [mut left, mut right]) = start();
        line.until([127, -64], || {
            left.command(ahead(1.0));
            right.command(ahead(-0.5));
        });
        let record = line.0.lock().unwrap();
        assert_eq!(
            record.packets[0],
            packet(130, TIMEOUT, 2),
            "before any motion"
        );
    }

    #[test]
    fn a_program_that_hangs_or_ends_stops_both_motors() {
        let (line, [mut left, mut right]) = start();
        let drive = |left: &mut OpenLoopMotor, right: &mut OpenLoopMotor| {
            left.command(ahead(1.0));
            right.command(ahead(1.0));
        };
        line.until([127, 127], || drive(&mut left, &mut right));
        // No command is repeated.
        line.until([0, 0], || {});
        line.until([127, 127], || drive(&mut left, &mut right));
        drop((left, right));
        assert_eq!(line.last(), [0, 0], "stopped before the drop returns");
    }

    #[test]
    fn a_line_that_takes_no_data_does_not_prevent_the_end() {
        let (line, motors) = start();
        // The thread's next write waits for the record.
        let blocked = line.0.lock().unwrap();
        let (ended, end) = mpsc::channel();
        let ending = std::thread::spawn(move || {
            drop(motors);
            // The test may have failed.
            let _ = ended.send(());
        });
        let result = end.recv_timeout(Duration::from_secs(20));
        drop(blocked);
        ending.join().unwrap();
        assert_eq!(result, Ok(()), "it waits for the line");
    }

    #[test]
    fn a_broken_line_is_a_fault_of_both_until_it_works_again() {
        let (line, [mut left, right]) = start();
        line.until([127, 0], || left.command(ahead(1.0)));
        line.0.lock().unwrap().is_broken = true;
        let wait = |wanted: bool| {
            let start = Instant::now();
            while (left.fault().is_some(), right.fault().is_some()) != (wanted, wanted) {
                assert!(start.elapsed() < Duration::from_secs(20));
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        wait(true);
        assert!(left.fault().unwrap().contains("unplugged"));
        line.0.lock().unwrap().is_broken = false;
        wait(false);
    }

    #[test]
    fn a_command_that_is_no_number_stops_it() {
        let (line, [mut left, _right]) = start();
        line.until([127, 0], || left.command(ahead(1.0)));
        line.until([0, 0], || left.command(ahead(f64::NAN)));
    }
}
