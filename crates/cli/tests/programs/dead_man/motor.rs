//! The vehicle's motors, as its primitive driver commands them: a Sabertooth motor controller, played
//! on a pseudoterminal. Each command is noted with its time, and moves a simulated rover.

use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use jaus_vehicle::actuator::{Actuator, Command, MotorConfig, SimulatedMotor};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;

/// Address of the controller: its factory setting.
const ADDRESS: u8 = 128;
/// Speed below which the rover is at rest, in m/s.
const REST: f64 = 0.01;
/// The controller stops its motors without a packet for this time: the driver sets that.
const TIMEOUT: Duration = Duration::from_millis(200);

/// The commands of both motors at a time, each a share of full speed, -1 to 1; 0 brakes.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: Instant,
    shares: [f64; 2],
}

/// How the motors stopped after an event.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopped {
    /// From the event to the command after which all commands were zero; `None` if there was none.
    pub(crate) command: Option<Duration>,
    /// From the event to rest.
    pub(crate) rest: Option<Duration>,
    /// Speed at the event in m/s.
    pub(crate) speed: f64,
    /// Way from the event on in metres.
    pub(crate) metres: f64,
}

/// The controller of the motors.
pub(crate) struct Motors {
    /// The driver's end of the line, which is open for as long as the controller is there.
    _line: OwnedFd,
    device: String,
    log: Arc<Mutex<Vec<Sample>>>,
}

impl Motors {
    pub(crate) fn new() -> Self {
        let ends = openpty(None, None).unwrap();
        let mut settings = tcgetattr(&ends.slave).unwrap();
        cfmakeraw(&mut settings);
        tcsetattr(&ends.slave, SetArg::TCSANOW, &settings).unwrap();
        let device = ttyname(&ends.slave).unwrap();
        let log = Arc::<Mutex<Vec<Sample>>>::default();
        let noted = log.clone();
        let mut line = File::from(ends.master);
        thread::spawn(move || {
            let mut reader = Packets::default();
            let mut octets = [0; 256];
            // The line reports an error once its other end is closed.
            while let Ok(read) = line.read(&mut octets) {
                let at = Instant::now();
                for shares in reader.read(&octets[..read]) {
                    noted.lock().unwrap().push(Sample { at, shares });
                }
            }
        });
        Self {
            _line: ends.slave,
            device: device.to_str().unwrap().to_owned(),
            log,
        }
    }

    /// The name of the serial line.
    pub(crate) fn device(&self) -> &str {
        &self.device
    }

    /// Whether every command of the last 0.3 s drove.
    pub(crate) fn drive(&self) -> bool {
        let since = Instant::now() - Duration::from_millis(300);
        let log = self.log.lock().unwrap();
        let last = log.partition_point(|it| it.at < since);
        log.len() > last && log[last..].iter().all(Sample::drives)
    }

    /// Whether the last command before a time drove.
    pub(crate) fn drove_at(&self, time: Instant) -> bool {
        let log = self.log.lock().unwrap();
        let before = log.partition_point(|it| it.at < time);
        before > 0 && log[before - 1].drives()
    }

    /// Whether no command has driven for some time.
    pub(crate) fn are_still(&self, time: Duration) -> bool {
        let since = Instant::now() - time;
        let log = self.log.lock().unwrap();
        let before = log.partition_point(|it| it.at < since);
        !log[before.saturating_sub(1)..].iter().any(Sample::drives)
    }

    /// The share of commands between two times that drove, 0 to 1.
    pub(crate) fn share_driven(&self, from: Instant, to: Instant) -> f64 {
        let log = self.log.lock().unwrap();
        let within = log.iter().filter(|it| (from..to).contains(&it.at));
        let driven = within.clone().filter(|it| it.drives()).count();
        driven as f64 / within.count().max(1) as f64
    }

    /// How the motors stopped after `event`, by the commands until now.
    pub(crate) fn stopped(&self, event: Instant) -> Stopped {
        let now = Instant::now();
        let log = self.log.lock().unwrap();
        let before = log.partition_point(|it| it.at < event);
        let mut zero = log
            .get(before.wrapping_sub(1))
            .is_none_or(|it| !it.drives())
            .then_some(event);
        for sample in &log[before..] {
            zero = if sample.drives() {
                None
            } else {
                zero.or(Some(sample.at))
            };
        }
        // Without commands, the controller brakes by itself.
        let end = log.last().map_or(event, |it| it.at + TIMEOUT);
        let zero = zero.or((end < now).then_some(end));
        let start = log.partition_point(|it| it.at + Duration::from_secs(10) < event);
        let rover = ride(&log[start..], event, now);
        Stopped {
            command: zero.map(|it| it - event),
            ..rover
        }
    }
}

impl Sample {
    fn drives(&self) -> bool {
        self.shares != [0.0; 2]
    }
}

/// Moves the simulated rover by the commands. The result has no `command`.
fn ride(log: &[Sample], event: Instant, until: Instant) -> Stopped {
    const STEP: Duration = SimulatedMotor::STEP;
    let mut wheels = [1, 2].map(|_| SimulatedMotor::new(MotorConfig::default()));
    let travel = |wheels: &[SimulatedMotor; 2]| (wheels[0].travel() + wheels[1].travel()) / 2.0;
    let mut commands = log.iter().peekable();
    let mut at = log.first().map_or(event, |it| it.at);
    let (mut speed, mut metres, mut moved) = (0.0, 0.0, None);
    while at < until {
        while let Some(sample) = commands.next_if(|it| it.at <= at) {
            for (wheel, &drive) in wheels.iter_mut().zip(&sample.shares) {
                let brake = if drive == 0.0 { 1.0 } else { 0.0 };
                wheel.command(Command { drive, brake });
            }
        }
        let before = travel(&wheels);
        wheels.iter_mut().for_each(|it| it.handle_time(at));
        let way = (travel(&wheels) - before).abs();
        let now = way / STEP.as_secs_f64();
        if at < event {
            speed = now;
        } else {
            metres += way;
            if now > REST {
                moved = Some(at);
            }
        }
        at += STEP;
    }
    let is_at_rest = moved.is_none_or(|it| it + 3 * STEP < until);
    let rest = moved.map_or(Duration::ZERO, |it| it - event);
    Stopped {
        command: None,
        rest: is_at_rest.then_some(rest),
        speed,
        metres,
    }
}

/// Reads the controller's packets: address, command, value and the sum of them modulo 128.
#[derive(Default)]
struct Packets {
    octets: Vec<u8>,
    shares: [f64; 2],
}

impl Packets {
    /// The commands of both motors after each packet of the second one.
    fn read(&mut self, octets: &[u8]) -> Vec<[f64; 2]> {
        self.octets.extend(octets);
        let mut commands = Vec::new();
        while let [address, command, value, checksum, ..] = self.octets[..] {
            let sum = address.wrapping_add(command).wrapping_add(value) & 0x7F;
            if address != ADDRESS || checksum != sum {
                self.octets.remove(0);
                continue;
            }
            self.octets.drain(..4);
            let share = f64::from(value) / 127.0;
            match command {
                0 => self.shares[0] = share,
                1 => self.shares[0] = -share,
                4 => self.shares[1] = share,
                5 => self.shares[1] = -share,
                // Settings.
                _ => continue,
            }
            if command >= 4 {
                commands.push(self.shares);
            }
        }
        commands
    }
}

#[test]
fn packets_are_found_again_after_damaged_ones() {
    let mut packets = Packets::default();
    assert_eq!(
        packets.read(&[7, 128, 0, 127, 127, 128, 5]),
        <[[f64; 2]; 0]>::default()
    );
    assert_eq!(packets.read(&[127, 4]), [[1.0, -1.0]]);
}
