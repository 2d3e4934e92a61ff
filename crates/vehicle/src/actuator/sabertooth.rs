//! Sabertooth motor controllers on a serial line (Dimension Engineering, packetized serial).
//!
//! A packet has four octets: the controller's address (128 to 135), a command, a value from 0 to
//! 127, and the sum of these three modulo 128. The controller never answers, so the line shows
//! neither its faults nor the travel of the wheels: travel is estimated from the commands, with the
//! lag of a [`SimulatedMotor`].
//!
//! The controller is told to stop its motors when it receives nothing for 200 ms (its serial
//! timeout, command 14), so they stop even if the program is killed. It forgets this when its power
//! fails, so it is told every second.
#![expect(
    clippy::disallowed_methods,
    reason = "writes to the controller in real time, on its own thread"
)]

use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{Actuator, Command, MotorConfig, SimulatedMotor};
use crate::motion::CommandDeadline;

/// One of the two motors of a controller. When both are dropped, the controller is commanded to
/// stop.
pub struct SabertoothMotor {
    controller: Arc<Controller>,
    index: usize,
    /// Estimates the travel.
    model: SimulatedMotor,
}

/// The thread that writes to the line, and what it writes.
struct Controller {
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

struct Shared {
    state: Mutex<State>,
    news: Condvar,
}

struct State {
    motors: [Setpoint; 2],
    fault: Option<String>,
    /// When the thread last wrote.
    written_at: Instant,
    ends: bool,
}

#[derive(Clone, Copy)]
struct Setpoint {
    share: f64,
    deadline: CommandDeadline,
}

impl Setpoint {
    /// The share of full speed in force: 0, if the last command has expired.
    fn share_at(&mut self, now: Instant) -> f64 {
        if self.share != 0.0 && self.deadline.has_passed(now) {
            tracing::warn!("watchdog: the motor stops because its command was not repeated");
            self.share = 0.0;
        }
        self.share
    }
}

impl SabertoothMotor {
    /// Interval between two packets for each motor.
    const PERIOD: Duration = Duration::from_millis(50);
    /// Interval between two settings of the serial timeout.
    const SETUP: Duration = Duration::from_secs(1);
    /// A thread that has not written for this time is stuck.
    const STUCK: Duration = Duration::from_millis(500);

    /// Starts motors 1 and 2 of the controller with this address (128 to 135) on a line.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub fn start(
        line: impl Write + Send + 'static,
        address: u8,
        config: MotorConfig,
    ) -> io::Result<[Self; 2]> {
        let setpoint = Setpoint {
            share: 0.0,
            deadline: CommandDeadline::new(config.deadline),
        };
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                motors: [setpoint; 2],
                fault: None,
                written_at: Instant::now(),
                ends: false,
            }),
            news: Condvar::new(),
        });
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("sabertooth".to_owned())
            .spawn(move || run(&of_thread, line, address))?;
        let controller = Arc::new(Controller {
            shared,
            thread: Mutex::new(Some(thread)),
        });
        Ok([0, 1].map(|index| Self {
            controller: Arc::clone(&controller),
            index,
            model: SimulatedMotor::new(config),
        }))
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Actuator for SabertoothMotor {
    fn handle_time(&mut self, now: Instant) {
        self.model.handle_time(now);
    }

    fn command(&mut self, command: Command) {
        let command = command.or_stop();
        self.model.command(command);
        let mut state = self.controller.shared.lock();
        let setpoint = &mut state.motors[self.index];
        // At 0 the controller brakes.
        let share = command.drive.clamp(-1.0, 1.0) * (1.0 - command.brake.clamp(0.0, 1.0));
        setpoint.deadline.restart(Some(Instant::now()));
        if setpoint.share != share {
            setpoint.share = share;
            self.controller.shared.news.notify_one();
        }
    }

    fn travel(&self) -> f64 {
        self.model.travel()
    }

    fn fault(&self) -> Option<String> {
        let state = self.controller.shared.lock();
        let is_stuck = state.written_at.elapsed() > Self::STUCK;
        let stuck = || is_stuck.then(|| "the motor controller's line takes no data".to_owned());
        state.fault.clone().or_else(stuck)
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.shared.lock().ends = true;
        self.shared.news.notify_one();
        let thread = self
            .thread
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(thread) = thread.take() {
            // Without the thread, the controller's own timeout stops the motors.
            let _ = thread.join();
        }
    }
}

/// Writes the setpoints until the motors are dropped, and then a stop.
fn run(shared: &Shared, mut line: impl Write, address: u8) {
    let mut set_up_at: Option<Instant> = None;
    loop {
        let now = Instant::now();
        let mut state = shared.lock();
        let ends = state.ends;
        let shares = match ends {
            true => [0.0; 2],
            false => [0, 1].map(|index: usize| state.motors[index].share_at(now)),
        };
        drop(state);
        let since = |at| now.saturating_duration_since(at);
        let sets_up = set_up_at.is_none_or(|at| since(at) >= SabertoothMotor::SETUP);
        let mut octets = Vec::new();
        if sets_up {
            octets.extend(packet(address, TIMEOUT, 2));
        }
        for (motor, share) in shares.into_iter().enumerate() {
            octets.extend(drive(address, motor, share));
        }
        let written = line.write_all(&octets).and_then(|()| line.flush());
        if ends {
            return;
        }
        let mut state = shared.lock();
        match written {
            Ok(()) => {
                state.fault = None;
                if sets_up {
                    set_up_at = Some(now);
                }
            }
            Err(error) => {
                state.fault = Some(format!("cannot write to the motor controller: {error}"));
                set_up_at = None;
            }
        }
        state.written_at = Instant::now();
        if !state.ends {
            let woken = shared.news.wait_timeout(state, SabertoothMotor::PERIOD);
            drop(woken.unwrap_or_else(PoisonError::into_inner));
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
mod tests {
    use super::*;

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

    fn start() -> (Line, [SabertoothMotor; 2]) {
        let line = Line::default();
        let motors = SabertoothMotor::start(line.clone(), 130, MotorConfig::default()).unwrap();
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
        let drive = |left: &mut SabertoothMotor, right: &mut SabertoothMotor| {
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
