//! Measures cells, one after another: engages the vehicle, holds a source over a link, lets something happen to it, and
//! watches the motors.

use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use super::bed::{Bed, CLEAR, within};
use super::cell::{Cell, Ending};
use super::link::{Begins, Link};
use super::operator::{Event, Operator, Source, Stop};

/// Least speeds of a vehicle that is driven, in m/s: by hand at up to 1.0, and on a mission at 0.2.
const BY_HAND: f64 = 0.5;
const MISSION: f64 = 0.1;
/// How long a source is held before something happens to it.
pub(crate) const HELD: Duration = Duration::from_secs(2);
/// How long the motors are observed after an event: what is retransmitted over a link that loses packets comes so late.
const WATCH: Duration = Duration::from_millis(3500);
/// The longest time that is waited for an emergency.
const LONGEST: Duration = Duration::from_secs(20);
/// Over a link that loses nothing, nothing comes after the motors have been still for so long.
const STILL: Duration = Duration::from_millis(1500);
/// A link that loses packets may end each drive before something happens to it.
const ATTEMPTS: usize = 16;

/// Measures with one operator.
pub(crate) struct Measurement<'a> {
    bed: &'a Bed,
    operator: Operator<'a>,
}

/// What became of a source that was held for some time.
enum Drive {
    /// It drives.
    On,
    /// It has ended since the link became worse, which was then.
    Ended(Instant),
    /// It did not drive since then.
    Refused(Instant),
}

impl<'a> Measurement<'a> {
    pub(crate) fn new(bed: &'a Bed) -> Self {
        Self {
            bed,
            operator: Operator::new(bed),
        }
    }

    /// A source is held over a link, and something happens to it.
    pub(crate) fn event(&mut self, source: Source, event: Event, link: Link) -> Cell {
        let name = format!("{}, {}, {}", source.name(), event.name(), link.name);
        let mut ending = Ending::NeverDriven;
        for _ in 0..ATTEMPTS {
            ending = self.hold_until(source, link, HELD, |it| it.happen(event, source));
            if !matches!(ending, Ending::NeverDriven) {
                break;
            }
            self.recover();
        }
        self.finish(name, link.dead_man_limit(), link, BY_HAND, ending)
    }

    /// A source has been held for some time, and the operator stops the vehicle at once.
    pub(crate) fn stop(&mut self, source: Source, stop: Stop, link: Link, held: Duration) -> Cell {
        let name = format!(
            "{}, {stop:?} after {} s, {}",
            source.name(),
            held.as_secs(),
            link.name
        );
        let mut pressed = SystemTime::now();
        let mut ending = Ending::NeverDriven;
        for _ in 0..ATTEMPTS {
            ending = self.hold_until(source, link, held, |it| {
                pressed = SystemTime::now();
                it.stop(stop)
            });
            self.emergency_is_seen();
            if !matches!(ending, Ending::NeverDriven) {
                break;
            }
            self.recover();
        }
        let emergency = match ending {
            Ending::StoppedBefore(_) | Ending::Refused | Ending::Jerks(_) => {
                self.bed.emergency_after(pressed)
            }
            _ => None,
        };
        let cell = self.finish(name, link.emergency_limit(), link, BY_HAND, ending);
        // Copies of the stop that come late are known to the station by the page that has pressed it.
        self.operator.let_go(source);
        self.operator.clear_emergency();
        Cell { emergency, ..cell }
    }

    /// A key drives, the link begins to lose packets, and some time later the operator stops the vehicle at once. Whether
    /// the drive lasts so long is up to the link; the emergency is measured all the same.
    pub(crate) fn stop_while_losing(&mut self, link: Link, losing: Duration) -> Cell {
        let bed = self.bed;
        let motors = &bed.motors;
        if !self.operator.is_intact() {
            self.operator.open();
        }
        self.operator.engage();
        let is_driven = self
            .operator
            .drive(Source::Keys, Duration::ZERO, || motors.drive());
        assert!(is_driven, "over a free link");
        bed.link.set(link.conditions);
        sleep(losing);
        let pressed = SystemTime::now();
        let event = self.operator.stop(Stop::Escape);
        // If the log ends with an emergency of before, it seems to have begun almost a day later.
        let acted = || bed.emergency_after(pressed).filter(|it| *it < LONGEST);
        within(LONGEST, || acted().is_some() && motors.are_still(STILL));
        let emergency = acted();
        // At once, if the drive had ended.
        let ending = Ending::Stopped(motors.stopped(event));
        self.emergency_is_seen();
        let cell = self.finish(
            format!("Escape, {}", link.name),
            link.emergency_limit(),
            link,
            BY_HAND,
            ending,
        );
        self.operator.clear_emergency();
        println!("emergency: {emergency:.2?}");
        Cell { emergency, ..cell }
    }

    /// A mission is under way, and the operator stops the vehicle at once.
    pub(crate) fn stop_mission(&mut self, stop: Stop, link: Link) -> Cell {
        let name = format!("mission, {stop:?}, {}", link.name);
        if link.begins == Begins::First {
            self.bed.link.set(link.conditions);
        }
        self.operator.open();
        self.operator.engage();
        self.operator.start_mission();
        self.bed.link.set(link.conditions_before_event());
        sleep(link.round_trip() + HELD);
        if link.begins == Begins::WithEvent {
            self.bed.link.set(link.conditions);
        }
        let event = self.operator.stop(stop);
        self.watch(event, link);
        // Nothing reaches the vehicle over a cut link: its mission goes on, as it was approved.
        let ending = if link.begins == Begins::WithEvent && self.bed.motors.drive() {
            Ending::GoesOn
        } else {
            Ending::Stopped(self.bed.motors.stopped(event))
        };
        self.emergency_is_seen();
        self.finish(name, link.emergency_limit(), link, MISSION, ending)
    }

    /// Holds a source over a link for some time until something happens to it, and watches how the motors stop.
    fn hold_until(
        &mut self,
        source: Source,
        link: Link,
        held: Duration,
        happen: impl FnOnce(&mut Operator<'a>) -> Instant,
    ) -> Ending {
        let set = |begins| {
            if link.begins == begins {
                self.bed.link.set(link.conditions);
            }
        };
        set(Begins::First);
        // A page measures its link: it must not know a worse one. What loses packets is not slower.
        if !link.is_lossy() || !self.operator.is_intact() {
            self.operator.open();
        }
        self.operator.engage();
        set(Begins::BeforeHolding);
        sleep(link.round_trip() + Duration::from_millis(300));
        let drive = self.drive(source, link, held);
        set(Begins::WithEvent);
        let event = happen(&mut self.operator);
        self.watch(event, link);
        let motors = &self.bed.motors;
        match drive {
            Drive::Refused(_) if link.is_lossy() => Ending::NeverDriven,
            Drive::Refused(begun) => match motors.share_driven(begun, event) {
                0.0 => Ending::Refused,
                share => Ending::Jerks(share),
            },
            Drive::Ended(changed) => Ending::StoppedBefore(motors.stopped(changed)),
            Drive::On if !motors.drove_at(event) => Ending::NeverDriven,
            Drive::On => Ending::Stopped(motors.stopped(event)),
        }
    }

    /// Holds a source for some time, with a few attempts: a busy machine ends a drive, too.
    fn drive(&mut self, source: Source, link: Link, held: Duration) -> Drive {
        const ATTEMPTS: usize = 3;
        let taken_up = Instant::now();
        for _ in 0..ATTEMPTS {
            let motors = &self.bed.motors;
            // The event comes as long as the drive lasts.
            if link.is_lossy() {
                let is_driven = || motors.drove_at(Instant::now());
                let held = held.min(source.first_sign());
                if self.operator.drive(source, held, is_driven) {
                    return Drive::On;
                }
                break;
            }
            if !self
                .operator
                .drive(source, Duration::ZERO, || motors.drive())
            {
                break;
            }
            let begun = Instant::now();
            if link.begins == Begins::WhileDriving {
                self.bed.link.set(link.conditions);
            }
            sleep(held);
            let now = Instant::now();
            let share = 100.0 * self.bed.motors.share_driven(begun, now);
            let time = (now - begun).as_secs_f64();
            println!("driven for {share:.0} % of {time:.1} s");
            match self.bed.motors.drive() {
                true => return Drive::On,
                false if link.begins == Begins::WhileDriving => return Drive::Ended(begun),
                false => self.operator.let_go(source),
            }
            sleep(Duration::from_millis(800));
        }
        self.operator.hold(source);
        Drive::Refused(taken_up)
    }

    /// Waits until it is known how the motors stop after an event.
    fn watch(&self, event: Instant, link: Link) {
        let limit = (event + WATCH).saturating_duration_since(Instant::now());
        within(limit, || link.is_free() && self.bed.motors.are_still(STILL));
    }

    /// Waits until the vehicle is in emergency, over a free link.
    fn emergency_is_seen(&mut self) {
        self.bed.link.set(CLEAR);
        self.operator.wait_for_emergency();
    }

    fn recover(&mut self) {
        self.bed.link.set(CLEAR);
        self.operator.let_go_of_all();
    }

    fn finish(
        &mut self,
        name: String,
        limit: Duration,
        link: Link,
        speed: f64,
        ending: Ending,
    ) -> Cell {
        let line = self.operator.line();
        self.recover();
        let cell = Cell {
            name,
            ending,
            limit,
            link,
            speed,
            emergency: None,
            line,
        };
        let limit = limit.as_secs_f64();
        println!("{}: {cell} (limit {limit:.2} s) [{}]", cell.name, cell.line);
        cell
    }
}
