//! VESC motor controllers on a CAN bus.
//!
//! A controller has an id from 0 to 254. Its frames have extended identifiers: the number of the
//! packet, then the id. It is commanded by duty cycle, and sends status frames at a rate set in VESC
//! Tool. Packets 9 (status 1: speed, current, duty cycle) and 27 (status 5: tachometer, voltage) are
//! needed here; the others are ignored.
//!
//! No status frame tells a fault. A controller in fault lets its motor coast and reports a duty cycle
//! of 0, so a controller that does not follow its command has a fault. One that falls silent too, and
//! one that reports a duty cycle without a command, against it, or far above it.
//!
//! The controller stops its motor by itself when no command arrives for its timeout, which can only be
//! set in VESC Tool and is 1 s at first.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::motion_monitor::MotionMonitor;
use super::motor_thread::{MotorLine, MotorThread};
use super::{Actuator, CanBus, CanFrame, Command};

/// The motor of one controller. When all motors of a bus are dropped, they are commanded to stop.
pub struct VescMotor {
    bus: Arc<MotorThread>,
    index: usize,
}

impl VescMotor {
    /// Starts the motors of the controllers with these ids on a bus. Commands expire after
    /// `deadline`.
    ///
    /// # Errors
    /// If the thread cannot be created.
    pub fn start<const N: usize>(
        bus: impl CanBus,
        ids: [u8; N],
        counts_per_metre: f64,
        deadline: Duration,
    ) -> io::Result<[Self; N]> {
        let motors = ids.map(|id| Vesc::new(id, counts_per_metre)).to_vec();
        let bus = MotorThread::start(VescBus { bus, motors }, N, deadline)?;
        Ok(std::array::from_fn(|index| Self {
            bus: Arc::clone(&bus),
            index,
        }))
    }
}

impl Actuator for VescMotor {
    fn handle_time(&mut self, _: Instant) {
        // The thread reads the bus.
    }

    fn command(&mut self, command: Command) {
        self.bus.command(self.index, command.or_stop());
    }

    fn travel(&self) -> f64 {
        self.bus.travel(self.index)
    }

    fn fault(&self) -> Option<String> {
        self.bus.fault()
    }
}

/// The controller of one motor, as seen from the bus.
#[derive(Debug, Clone)]
struct Vesc {
    id: u8,
    /// Counts of the tachometer per metre of travel.
    counts_per_metre: f64,
    /// The commanded share of full duty, -1 to 1.
    share: f64,
    /// The last reported duty cycle.
    duty: Option<(Instant, f64)>,
    tachometer: Option<(Instant, i32)>,
    travel: f64,
    /// Compares the duty cycle with the command.
    monitor: MotionMonitor,
    /// Since when it has not followed its command.
    idle_since: Option<Instant>,
    /// When it was last found to be in fault.
    failed_at: Option<Instant>,
}

impl Vesc {
    const SET_DUTY: u32 = 0;
    const STATUS_1: u32 = 9;
    const STATUS_5: u32 = 27;
    /// Greatest interval between two status frames of a kind.
    const SILENCE: Duration = Duration::from_millis(250);
    /// A controller commanded above the first share follows if it reports a duty cycle above the second.
    const FOLLOWS: (f64, f64) = (0.1, 0.02);
    /// A controller follows within this time.
    const RESPONSE: Duration = Duration::from_millis(500);
    /// A fault is reported for at least this time, because it ends with the command.
    const HOLD: Duration = Duration::from_secs(1);

    const fn new(id: u8, counts_per_metre: f64) -> Self {
        Self {
            id,
            counts_per_metre,
            share: 0.0,
            duty: None,
            tachometer: None,
            travel: 0.0,
            monitor: MotionMonitor::new(1.0),
            idle_since: None,
            failed_at: None,
        }
    }

    /// The frame that commands a share of full duty; at 0 the controller brakes.
    fn command(&mut self, share: f64) -> CanFrame {
        self.share = share;
        let duty = (share * 100_000.0).round() as i32;
        let id = Self::SET_DUTY << 8 | u32::from(self.id);
        CanFrame::new(id, &duty.to_be_bytes())
    }

    /// Takes a frame of the bus, whoever sent it.
    fn handle_frame(&mut self, now: Instant, frame: &CanFrame) {
        if frame.id() & 0xFF != u32::from(self.id) {
            return;
        }
        match (frame.id() >> 8, frame.data()) {
            (Self::STATUS_1, &[_, _, _, _, _, _, high, low]) => {
                let duty = f64::from(i16::from_be_bytes([high, low])) / 1000.0;
                self.duty = Some((now, duty));
            }
            (Self::STATUS_5, &[a, b, c, d, ..]) => {
                self.handle_tachometer(now, i32::from_be_bytes([a, b, c, d]));
            }
            _ => {}
        }
    }

    /// After a silence the counts may be those of a controller that has restarted.
    fn handle_tachometer(&mut self, now: Instant, count: i32) {
        let before = self.tachometer.replace((now, count));
        if let Some((at, before)) = before
            && now.saturating_duration_since(at) <= Self::SILENCE
        {
            self.travel += f64::from(count.wrapping_sub(before)) / self.counts_per_metre;
        }
    }

    /// Distance travelled in metres.
    const fn travel(&self) -> f64 {
        self.travel
    }

    /// The fault at `now`, as text for the operator.
    fn fault(&mut self, now: Instant) -> Option<String> {
        let id = self.id;
        let is_old = |at| now.saturating_duration_since(at) > Self::SILENCE;
        let silent = [
            (1, self.duty.map(|(at, _)| at)),
            (5, self.tachometer.map(|(at, _)| at)),
        ];
        if let Some((status, _)) = silent.iter().find(|(_, at)| at.is_none_or(is_old)) {
            return Some(format!(
                "motor controller {id} sends no status {status}: check its power, the bus, and its \
                 CAN status messages in VESC Tool (1 and 5, at least 20 Hz)"
            ));
        }
        self.check_duty(now);
        if let Some(fault) = self.monitor.fault() {
            return Some(format!("motor controller {id} {fault}: cut its power"));
        }
        let failed_at = self.failed_at?;
        (now.saturating_duration_since(failed_at) <= Self::HOLD).then(|| {
            format!("motor controller {id} does not follow its command: VESC Tool shows its fault")
        })
    }

    fn check_duty(&mut self, now: Instant) {
        if let Some((_, duty)) = self.duty {
            let command = match self.share == 0.0 {
                true => Command::STOP,
                false => Command {
                    drive: self.share,
                    brake: 0.0,
                },
            };
            self.monitor.handle_speed(now, command, duty);
        }
        let (wanted, least) = Self::FOLLOWS;
        let drives = self.duty.is_some_and(|(_, duty)| duty.abs() >= least);
        if self.share.abs() < wanted || drives {
            self.idle_since = None;
            return;
        }
        let since = *self.idle_since.get_or_insert(now);
        if now.saturating_duration_since(since) > Self::RESPONSE {
            self.failed_at = Some(now);
        }
    }
}

/// The controllers on a bus.
struct VescBus<B> {
    bus: B,
    motors: Vec<Vesc>,
}

impl<B: CanBus> VescBus<B> {
    /// Frames taken in one exchange; a flooded bus must not delay the commands.
    const MOST: usize = 256;

    fn receive(&mut self, now: Instant) -> io::Result<()> {
        for _ in 0..Self::MOST {
            let Some(frame) = self.bus.receive()? else {
                return Ok(());
            };
            for motor in &mut self.motors {
                motor.handle_frame(now, &frame);
            }
        }
        Ok(())
    }
}

impl<B: CanBus> MotorLine for VescBus<B> {
    const NAME: &'static str = "vesc";
    const PERIOD: Duration = Duration::from_millis(20);

    fn exchange(&mut self, now: Instant, shares: &[f64]) -> Result<(), String> {
        let received = self.receive(now);
        let mut sent = Ok(());
        for (motor, &share) in self.motors.iter_mut().zip(shares) {
            // Also to the others, if one cannot be sent.
            sent = self.bus.send(&motor.command(share)).and(sent);
        }
        let broken = |error| format!("the CAN bus does not work: {error}");
        received.and(sent).map_err(broken)?;
        let mut faults = self.motors.iter_mut().map(|motor| motor.fault(now));
        match faults.find_map(|fault| fault) {
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    fn travel(&self, motor: usize) -> f64 {
        self.motors.get(motor).map_or(0.0, Vesc::travel)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::actuator::VirtualBus;

    /// Two controllers on a bus that answer their commands, and the line that commands them.
    struct Bench {
        line: VescBus<VirtualBus>,
        bus: VirtualBus,
        now: Instant,
        /// Whether a controller is silent, or in fault.
        is_silent: [bool; 2],
        is_in_fault: [bool; 2],
        duties: [f64; 2],
        counts: [i32; 2],
    }

    const IDS: [u8; 2] = [10, 101];

    impl Bench {
        fn new() -> Self {
            let bus = VirtualBus::default();
            let motors = IDS.map(|id| Vesc::new(id, 200.0)).to_vec();
            Self {
                line: VescBus {
                    bus: bus.join(),
                    motors,
                },
                bus: bus.join(),
                now: Instant::now(),
                is_silent: [false; 2],
                is_in_fault: [false; 2],
                duties: [0.0; 2],
                counts: [i32::MAX - 50; 2],
            }
        }

        /// Exchanges every 20 ms. Full duty is 400 counts a second. Returns the last fault.
        fn run(&mut self, millis: u32, shares: [f64; 2]) -> Option<String> {
            let mut fault = None;
            for _ in 0..millis / 20 {
                self.now += Duration::from_millis(20);
                fault = self.line.exchange(self.now, &shares).err();
                while let Ok(Some(frame)) = self.bus.receive() {
                    let motor = IDS.iter().position(|id| u32::from(*id) == frame.id());
                    let duty = i32::from_be_bytes(frame.data().try_into().unwrap());
                    self.duties[motor.unwrap()] = f64::from(duty) / 1e5;
                }
                for motor in 0..2 {
                    self.answer(motor);
                }
            }
            fault
        }

        fn answer(&mut self, motor: usize) {
            if self.is_in_fault[motor] {
                self.duties[motor] = 0.0;
            }
            let duty = self.duties[motor];
            self.counts[motor] = self.counts[motor].wrapping_add((duty * 8.0).round() as i32);
            if self.is_silent[motor] {
                return;
            }
            let id = u32::from(IDS[motor]);
            let duty = ((duty * 1000.0) as i16).to_be_bytes();
            let status = [0, 0, 0x10, 0, 0, 50, duty[0], duty[1]];
            self.bus.send(&CanFrame::new(9 << 8 | id, &status)).unwrap();
            let [a, b, c, d] = self.counts[motor].to_be_bytes();
            let status = [a, b, c, d, 0, 240, 0, 0];
            self.bus
                .send(&CanFrame::new(27 << 8 | id, &status))
                .unwrap();
        }
    }

    #[test]
    fn frames_are_those_of_the_published_protocol() {
        // Controller 10, 50 %: identifier 0x00A, 50000.
        let frame = Vesc::new(10, 1.0).command(0.5);
        assert_eq!((frame.id(), frame.data()), (0x00A, &[0, 0, 0xC3, 0x50][..]));
        let frame = Vesc::new(10, 1.0).command(-1.0);
        assert_eq!(frame.data(), [0xFF, 0xFE, 0x79, 0x60]);
        // Controller 101 sends status 1 as 0x965: 3000 electrical rpm, 1.2 A, 25 %.
        let mut vesc = Vesc::new(101, 1.0);
        let now = Instant::now();
        let status = CanFrame::new(0x965, &[0, 0, 0x0B, 0xB8, 0, 12, 0, 250]);
        vesc.handle_frame(now, &status);
        assert_eq!(vesc.duty, Some((now, 0.25)));
        vesc.handle_frame(
            now,
            &CanFrame::new(0x1B65, &[0xFF, 0xFF, 0xFF, 0xFE, 0, 240, 0, 0]),
        );
        assert_eq!(vesc.tachometer, Some((now, -2)));
    }

    #[test]
    fn frames_of_others_cut_ones_and_unknown_ones_change_nothing() {
        let mut vesc = Vesc::new(10, 1.0);
        for (id, data) in [
            (0x965, &[0_u8; 8][..]),
            (0x90A, &[0; 7]),
            (0x1B0A, &[0; 3]),
            (0xE0A, &[0; 8]),
            (0x1FFF_FF0A, &[0; 8]),
        ] {
            vesc.handle_frame(Instant::now(), &CanFrame::new(id, data));
        }
        assert_eq!((vesc.duty, vesc.tachometer), (None, None));
    }

    #[test]
    fn motors_turn_as_commanded_and_their_travel_is_measured() {
        let mut bench = Bench::new();
        assert!(
            bench
                .run(20, [0.0; 2])
                .is_some_and(|it| it.contains("status 1"))
        );
        assert_eq!(bench.run(1000, [0.0; 2]), None);
        assert_eq!(bench.run(1000, [1.0, -0.5]), None);
        assert_eq!(bench.duties, [1.0, -0.5]);
        // Over the largest count: 50 steps of 8 and -4 counts, the last one not yet received.
        let travel = [0, 1].map(|motor| bench.line.travel(motor));
        let expected = [49.0 * 8.0 / 200.0, -49.0 * 4.0 / 200.0];
        let is_close = |(found, metres): (f64, f64)| (found - metres).abs() < 1e-9;
        assert!(travel.into_iter().zip(expected).all(is_close), "{travel:?}");
    }

    #[test]
    fn a_controller_that_falls_silent_is_a_fault_until_it_is_back() {
        let mut bench = Bench::new();
        bench.run(200, [0.0; 2]);
        bench.is_silent = [false, true];
        assert_eq!(bench.run(240, [0.5; 2]), None);
        let fault = bench.run(60, [0.5; 2]).unwrap();
        assert!(
            fault.starts_with("motor controller 101 sends no status 1"),
            "{fault}"
        );
        let before = bench.line.travel(1);
        bench.is_silent = [false; 2];
        bench.counts[1] = 0;
        assert_eq!(bench.run(200, [0.0; 2]), None);
        assert_eq!(bench.line.travel(1), before, "its counter restarted");
    }

    #[test]
    fn a_controller_that_does_not_follow_is_a_fault_beyond_the_end_of_the_command() {
        let mut bench = Bench::new();
        bench.run(200, [0.0; 2]);
        bench.is_in_fault = [true, false];
        assert_eq!(bench.run(500, [0.5; 2]), None);
        let fault = bench.run(60, [0.5; 2]).unwrap();
        assert!(
            fault.starts_with("motor controller 10 does not follow"),
            "{fault}"
        );
        assert!(
            bench.run(900, [0.0; 2]).is_some(),
            "nothing is commanded any more"
        );
        assert_eq!(bench.run(200, [0.0; 2]), None);
    }

    #[test]
    fn a_controller_that_turns_without_a_command_or_against_it_is_a_fault() {
        for (share, duty, says) in [
            (0.0, 0.3, "turns without a command"),
            (0.5, -0.4, "turns the wrong way"),
            (0.2, 0.9, "turns faster than commanded"),
        ] {
            let mut vesc = Vesc::new(10, 1.0);
            let mut now = Instant::now();
            let mut fault = None;
            for _ in 0..60 {
                now += Duration::from_millis(20);
                vesc.command(share);
                let [high, low] = ((duty * 1000.0) as i16).to_be_bytes();
                let status = [0, 0, 0, 0, 0, 0, high, low];
                vesc.handle_frame(now, &CanFrame::new(0x90A, &status));
                vesc.handle_frame(now, &CanFrame::new(0x1B0A, &[0; 8]));
                fault = vesc.fault(now);
            }
            let fault = fault.unwrap();
            assert!(fault.contains(says), "{fault}");
        }
    }

    #[test]
    fn a_bus_that_is_off_is_a_fault_and_commands_are_tried_again() {
        let mut bench = Bench::new();
        bench.run(200, [0.0; 2]);
        bench.bus.set_off(true);
        let fault = bench.line.exchange(bench.now, &[0.5; 2]).unwrap_err();
        assert_eq!(fault, "the CAN bus does not work: bus-off");
        bench.bus.set_off(false);
        assert_eq!(bench.run(300, [0.5; 2]), None);
        assert_eq!(bench.duties, [0.5; 2]);
    }
}
