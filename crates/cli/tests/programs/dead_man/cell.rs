//! A cell of the table: a source, what happens to it, and the link; measured at the motors.

use std::fmt;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use super::bed::{BothWays, CLEAR};
use super::motor::Stopped;
use super::operator::{Event, Operator, Source, Stop};
use super::relay::Conditions;
use crate::dead_man::bed::Bed;

/// Motion ends within this after the last sign of life, plus the one-way delay.
pub(crate) const DEAD_MAN: Duration = Duration::from_millis(500);
/// An emergency stop acts within this, plus the one-way delay and the time of its octets on the link.
const EMERGENCY: Duration = Duration::from_millis(300);
/// Octets of an emergency stop on the link, with all headers.
const EMERGENCY_OCTETS: f64 = 200.0;
/// Least speeds of a vehicle that is driven, in m/s: by hand at up to 1.0, and on a mission at 0.2.
const BY_HAND: f64 = 0.5;
const MISSION: f64 = 0.1;
/// How long the motors are observed after an event.
const WATCH: Duration = Duration::from_millis(3500);

/// A link between browser and station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) name: &'static str,
    pub(crate) conditions: BothWays,
    /// When the link becomes so.
    pub(crate) begins: Begins,
    /// Whether nobody may drive over it.
    pub(crate) is_refused: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Begins {
    /// Before the page is opened.
    First,
    /// Before something is held.
    BeforeHolding,
    /// While the vehicle is driven.
    WhileDriving,
    /// With the event.
    WithEvent,
}

const fn delayed(millis: u64) -> BothWays {
    let delay = Duration::from_millis(millis);
    [Conditions {
        delay,
        ..Conditions::CLEAR
    }; 2]
}

const fn lossy(loss: u32, jitter: u64) -> BothWays {
    let jitter = Duration::from_millis(jitter);
    [Conditions {
        loss,
        jitter,
        ..Conditions::CLEAR
    }; 2]
}

const SLOW: Conditions = Conditions {
    rate: Some(400.0),
    ..Conditions::CLEAR
};

impl Link {
    pub(crate) const DIRECT: Self = Self::new("0", CLEAR, Begins::First);
    pub(crate) const DELAYED: Self = Self::new("0.3 s", delayed(300), Begins::First);
    pub(crate) const SLOW: Self = Self::new("400 octets/s", [SLOW; 2], Begins::WhileDriving);
    /// The way back is free: the picture stays fresh.
    pub(crate) const SLOW_UP: Self = Self::new(
        "400 octets/s up",
        [SLOW, Conditions::CLEAR],
        Begins::WhileDriving,
    );
    pub(crate) const LOSSY: Self = Self::new("5 % loss", lossy(50, 30), Begins::BeforeHolding);
    pub(crate) const VERY_LOSSY: Self =
        Self::new("30 % loss", lossy(300, 50), Begins::BeforeHolding);
    pub(crate) const CUT: Self = Self::new("cut", [Conditions::CUT; 2], Begins::WithEvent);
    pub(crate) const ALL: [Self; 7] = [
        Self::DIRECT,
        Self::DELAYED,
        Self::SLOW_UP,
        Self::SLOW,
        Self::LOSSY,
        Self::VERY_LOSSY,
        Self::CUT,
    ];
    /// Links that are too slow to drive over.
    pub(crate) const REFUSED: [Self; 4] = [
        Self::new("0.8 s", delayed(800), Begins::BeforeHolding).refused(),
        Self::new("1.5 s", delayed(1500), Begins::BeforeHolding).refused(),
        Self::new("0.8 s later", delayed(800), Begins::WhileDriving).refused(),
        Self::new("1.5 s later", delayed(1500), Begins::WhileDriving).refused(),
    ];

    const fn new(name: &'static str, conditions: BothWays, begins: Begins) -> Self {
        Self {
            name,
            conditions,
            begins,
            is_refused: false,
        }
    }

    const fn refused(self) -> Self {
        Self {
            is_refused: true,
            ..self
        }
    }

    /// Whether a vehicle must be drivable over it all the time.
    fn is_free(&self) -> bool {
        let is_free = |it: &Conditions| it.loss == 0 && it.rate.is_none();
        let before = self.conditions_before_event();
        !self.is_refused && before.iter().all(is_free)
    }

    /// The longest time that a packet is under way when the link is free.
    pub(crate) fn one_way(&self) -> Duration {
        self.conditions[0].delay + self.conditions[0].jitter
    }

    pub(crate) fn round_trip(&self) -> Duration {
        self.conditions.iter().map(|it| it.delay + it.jitter).sum()
    }

    /// Limit of the 99th of 100 emergency stops with loss.
    pub(crate) fn lossy_limit(&self) -> Duration {
        self.one_way() + 2 * (self.round_trip() + Duration::from_millis(200))
    }

    /// The conditions between the start of the drive and the event.
    fn conditions_before_event(&self) -> BothWays {
        if self.begins == Begins::WithEvent {
            CLEAR
        } else {
            self.conditions
        }
    }

    fn emergency_limit(&self) -> Duration {
        let rate = self.conditions[0].rate;
        let sent = rate.map_or(Duration::ZERO, |it| {
            Duration::from_secs_f64(EMERGENCY_OCTETS / it)
        });
        if self.begins == Begins::WithEvent {
            return DEAD_MAN;
        }
        if self.conditions[0].loss > 0 {
            return self.lossy_limit();
        }
        self.one_way() + sent + EMERGENCY
    }
}

/// How a cell ended.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ending {
    /// It was driven until the event, and stopped.
    Stopped(Stopped),
    /// It had stopped before the event, because the link had become worse: times are from then on.
    StoppedBefore(Stopped),
    /// It was never driven.
    Refused,
}

/// A measured cell.
pub(crate) struct Cell {
    pub(crate) name: String,
    pub(crate) ending: Ending,
    pub(crate) limit: Duration,
    link: Link,
    /// Speed before the event over a free link, in m/s, at least.
    speed: f64,
    /// When an emergency stop of a vehicle that stood already was in force.
    emergency: Option<Duration>,
    /// What the page said about driving at the end.
    pub(crate) line: String,
}

impl Cell {
    pub(crate) fn with_limit(self, limit: Duration) -> Self {
        Self { limit, ..self }
    }

    /// Whether the vehicle was driven before the event: over a free link as fast as commanded, not in jerks.
    fn has_moved(&self, stopped: &Stopped) -> bool {
        !self.link.is_free() || stopped.speed >= self.speed
    }

    /// Whether the motors stopped within the limit.
    pub(crate) fn is_met(&self) -> bool {
        let is_in_time = |it: &Stopped| it.command.is_some_and(|time| time <= self.limit);
        match &self.ending {
            Ending::Stopped(stopped) => {
                !self.link.is_refused && is_in_time(stopped) && self.has_moved(stopped)
            }
            Ending::StoppedBefore(stopped) => {
                stopped.command.is_some_and(|time| time <= DEAD_MAN)
                    && self.emergency.is_none_or(|time| time <= self.limit)
            }
            Ending::Refused => !self.link.is_free() || self.link.is_refused,
        }
    }
}

impl fmt::Display for Cell {
    /// For example `0.12 s; 0.40 s, 1.0 m/s, 0.25 m`: the command, then rest, speed and distance. A missed limit is bold.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |time: Option<Duration>| {
            time.map_or_else(
                || "never".to_owned(),
                |it| format!("{:.2} s", it.as_secs_f64()),
            )
        };
        let is_emergency_late = self.emergency.is_some_and(|time| time > self.limit);
        let (before, stopped) = match &self.ending {
            Ending::Refused if self.is_met() => return f.write_str("refused"),
            Ending::Refused => return f.write_str("**refused**"),
            Ending::Stopped(stopped) => ("", stopped),
            Ending::StoppedBefore(stopped) => ("link: ", stopped),
        };
        let mark = if self.is_met() || is_emergency_late {
            ""
        } else {
            "**"
        };
        write!(
            f,
            "{before}{mark}{}{mark}; {}, {:.1} m/s, {:.2} m",
            seconds(stopped.command),
            seconds(stopped.rest),
            stopped.speed,
            stopped.metres
        )?;
        match self.emergency {
            Some(time) if is_emergency_late => {
                write!(f, "; emergency **{:.2} s**", time.as_secs_f64())
            }
            Some(time) => write!(f, "; emergency {:.2} s", time.as_secs_f64()),
            None => Ok(()),
        }
    }
}

/// Measures cells, one after another, with one operator.
pub(crate) struct Measurement<'a> {
    pub(crate) bed: &'a Bed,
    pub(crate) operator: Operator<'a>,
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
        let limit = DEAD_MAN + link.one_way();
        self.measure(name, limit, source, link, Duration::from_secs(2), |it| {
            it.happen(event, source)
        })
    }

    /// A source has been held for some time, and the operator stops the vehicle at once.
    pub(crate) fn stop(&mut self, source: Source, stop: Stop, link: Link, held: Duration) -> Cell {
        let name = format!(
            "{}, {stop:?} after {} s, {}",
            source.name(),
            held.as_secs(),
            link.name
        );
        let limit = link.emergency_limit();
        let mut pressed = SystemTime::now();
        let mut cell = self.measure(name, limit, source, link, held, |it| {
            pressed = SystemTime::now();
            it.stop(stop)
        });
        self.emergency_is_seen();
        if let Ending::StoppedBefore(_) = cell.ending {
            cell.emergency = self.bed.emergency_after(pressed);
        }
        cell
    }

    /// A mission is under way, and the operator stops the vehicle at once.
    pub(crate) fn stop_mission(&mut self, stop: Stop, link: Link) -> Cell {
        let name = format!("mission, {stop:?}, {}", link.name);
        if link.begins == Begins::First {
            self.bed.link.set(link.conditions);
        }
        self.operator.engage();
        self.operator.start_mission();
        self.bed.link.set(link.conditions_before_event());
        sleep(link.round_trip() + Duration::from_secs(2));
        if link.begins == Begins::WithEvent {
            self.bed.link.set(link.conditions);
        }
        let event = self.operator.stop(stop);
        sleep((event + WATCH).saturating_duration_since(Instant::now()));
        let ending = Ending::Stopped(self.bed.motors.stopped(event));
        // Nothing reaches the vehicle over a cut link: its mission goes on, as it was approved.
        let cell = self.finish(name, link.emergency_limit(), link, MISSION, ending);
        self.emergency_is_seen();
        cell
    }

    /// Waits until the vehicle is in emergency, over a free link.
    fn emergency_is_seen(&mut self) {
        self.bed.link.set(CLEAR);
        assert!(
            self.operator.sees_emergency(),
            "the emergency is repeated until the vehicle confirms it"
        );
    }

    fn measure(
        &mut self,
        name: String,
        limit: Duration,
        source: Source,
        link: Link,
        held: Duration,
        happen: impl FnOnce(&mut Operator<'a>) -> Instant,
    ) -> Cell {
        let ending = self.run(source, link, held, happen);
        self.finish(name, limit, link, BY_HAND, ending)
    }

    fn finish(
        &mut self,
        name: String,
        limit: Duration,
        link: Link,
        speed: f64,
        ending: Ending,
    ) -> Cell {
        let line = match self.operator.is_open() {
            true => self.operator.line(),
            false => String::new(),
        };
        self.operator.recover();
        let cell = Cell {
            name,
            ending,
            limit,
            link,
            speed,
            emergency: None,
            line,
        };
        println!(
            "{}: {cell} (limit {:.2} s) [{}]",
            cell.name,
            limit.as_secs_f64(),
            cell.line
        );
        cell
    }

    fn run(
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
        self.operator.engage();
        set(Begins::BeforeHolding);
        sleep(link.round_trip() + Duration::from_millis(300));
        let Some(changed) = self.drive(source, link, held) else {
            return Ending::Refused;
        };
        let has_stopped = link.begins == Begins::WhileDriving && !self.bed.motors.drive();
        set(Begins::WithEvent);
        let event = happen(&mut self.operator);
        sleep((event + WATCH).saturating_duration_since(Instant::now()));
        match has_stopped {
            true => Ending::StoppedBefore(self.bed.motors.stopped(changed)),
            false => Ending::Stopped(self.bed.motors.stopped(event)),
        }
    }

    /// Holds a source for some time. Returns since when the vehicle is driven or, if the link becomes worse meanwhile, when
    /// that was; `None` if it is not driven.
    fn drive(&mut self, source: Source, link: Link, held: Duration) -> Option<Instant> {
        /// A busy machine ends a drive, too: what is held is taken up once more.
        const ATTEMPTS: usize = 3;
        // A lossy link may end a drive at any time: the event comes as long as it lasts.
        let is_lossy = link.conditions_before_event()[0].loss > 0;
        let held = if is_lossy {
            held.min(Duration::from_millis(700))
        } else {
            held
        };
        for _ in 0..ATTEMPTS {
            if !self.operator.drive(source, Duration::from_secs(8)) {
                return None;
            }
            let begun = Instant::now();
            if link.begins == Begins::WhileDriving {
                self.bed.link.set(link.conditions);
            }
            sleep(held);
            let now = Instant::now();
            let share = 100.0 * self.bed.motors.share_driven(begun, now);
            println!(
                "driven for {share:.0} % of {:.1} s",
                (now - begun).as_secs_f64()
            );
            if link.begins == Begins::WhileDriving || self.bed.motors.drive() {
                return Some(begun);
            }
            self.operator.let_go(source);
            sleep(Duration::from_millis(800));
        }
        None
    }
}
