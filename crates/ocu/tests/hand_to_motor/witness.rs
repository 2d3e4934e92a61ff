//! Judges every step of a trial: what moves has a living hand behind it.

use std::cmp;
use std::time::Duration;

use crate::air::Weather;
use crate::cable::Wire;
use crate::story;
use crate::vehicle::Way;

/// Motion ends so long after the last sign of life, and the time of one way.
const DEAD_MAN: Duration = Duration::from_millis(500);
/// The same if a second part of the way fails before the motion has ended: the limits of the page, 0.4 s,
/// and of the vehicle follow each other.
const DEAD_MAN_TWICE: Duration = Duration::from_millis(900);
/// A key that has never been repeated counts for longer.
const FIRST_REPEAT: Duration = Duration::from_millis(300);
/// The station sends an emergency on at once.
const EMERGENCY: Duration = Duration::from_millis(300);
/// The longest pause between two repetitions of a stop.
const REPETITION: Duration = Duration::from_millis(500);
/// A setpoint that is taken up sets the vehicle in motion within this time, and the time of one way.
const BEGINNING: Duration = Duration::from_millis(500);
/// What begins to move begins by a setpoint that has waited no longer.
const WAITING: Duration = Duration::from_millis(300);
/// For so long a trial goes on in which a rule is broken.
const EPILOGUE: Duration = Duration::from_secs(1);
/// What is not there after a start may still be on its way.
const PROLOGUE: Duration = Duration::from_secs(5);
/// The steps of the simulation, one for each hop.
const STEPS: Duration = Duration::from_millis(40);
/// For how long the delays of the past count: the station's memory of round trips.
const MEMORY: Duration = Duration::from_secs(11);

/// What works at a moment.
pub(crate) struct Lives {
    pub(crate) pages: [bool; 2],
    pub(crate) station: bool,
    pub(crate) air: [bool; 2],
    pub(crate) vehicles: [bool; 2],
    pub(crate) wires: [Wire; 2],
    pub(crate) weather: Weather,
    /// Whether a page says that its connection is live.
    pub(crate) live: [bool; 2],
    /// Whether the programs run for so long that they know each other.
    pub(crate) settled: [bool; 3],
}

/// Whether no datagram is lost or late.
const fn is_smooth(lives: &Lives) -> bool {
    lives.weather.detoured == 0 && !lives.weather.is_lossy()
}

/// A hand that holds or has held something, and the vehicle that it means.
struct Hold {
    page: usize,
    vehicle: usize,
    way: Way,
    begun: Duration,
    /// When all was well for the last time: the hand, and every part of the way to the motor.
    alive: Duration,
    /// When every part of the way was well for the last time, whatever the hand did.
    connected: Duration,
    over: bool,
    /// The last sign of a hand that is over.
    last: Duration,
    /// The parts that have failed since then.
    failed: u8,
    /// A key that was never repeated.
    is_first: bool,
    /// Nobody has told the page that the hand is gone.
    is_lost: bool,
    /// Whether the page said that it can be driven.
    was_ready: bool,
    /// Whether it has moved the vehicle.
    has_moved: bool,
}

/// An emergency stop on its way.
struct Stop {
    page: usize,
    vehicle: usize,
    at: Duration,
    /// Since when the way to the vehicle has been free.
    free_since: Option<Duration>,
}

pub(crate) struct Witness {
    /// The rate of the slowest clock: limits are measured by it.
    slowest: f64,
    holds: Vec<Hold>,
    stops: Vec<Stop>,
    /// Vehicles in emergency.
    emergencies: [bool; 2],
    /// The longest one-way times of the last seconds: page to station, and station to vehicle.
    ways: Vec<(Duration, [Duration; 2], Duration)>,
    driven: [Option<Way>; 2],
    /// Whether only clocks are wrong, so that no drive may be interrupted.
    pub(crate) is_quiet: bool,
    pub(crate) broken: Option<String>,
    broken_at: Duration,
    /// The longest motion after a last sign of life, without the one-way time.
    pub(crate) longest: Duration,
    /// Hands that have moved a vehicle.
    pub(crate) moved: u32,
    pub(crate) emergencies_checked: u32,
}

impl Witness {
    pub(crate) const fn new(slowest: f64) -> Self {
        Self {
            slowest,
            holds: Vec::new(),
            stops: Vec::new(),
            emergencies: [false; 2],
            ways: Vec::new(),
            driven: [None; 2],
            is_quiet: false,
            broken: None,
            broken_at: Duration::ZERO,
            longest: Duration::ZERO,
            moved: 0,
            emergencies_checked: 0,
        }
    }

    /// A clock has become slower.
    pub(crate) const fn handle_rate(&mut self, rate: f64) {
        self.slowest = self.slowest.min(rate);
    }

    pub(crate) fn hold(
        &mut self,
        now: Duration,
        (page, vehicle, way): (usize, usize, Way),
        was_ready: bool,
    ) {
        self.end(page, now, true);
        self.holds.push(Hold {
            page,
            vehicle,
            way,
            begun: now,
            alive: now,
            connected: now,
            over: false,
            last: now,
            failed: 0,
            is_first: false,
            is_lost: false,
            was_ready,
            has_moved: false,
        });
    }

    /// The hand of a page was lost after its last sign of life at `last`.
    pub(crate) fn lose(&mut self, page: usize, last: Duration, has_renewed: bool) {
        for hold in self
            .holds
            .iter_mut()
            .filter(|it| it.page == page && !it.over)
        {
            hold.is_lost = true;
        }
        self.end(page, last, has_renewed);
    }

    /// The hand of a page is over since `last`.
    pub(crate) fn end(&mut self, page: usize, last: Duration, has_renewed: bool) {
        for hold in self
            .holds
            .iter_mut()
            .filter(|it| it.page == page && !it.over)
        {
            hold.over = true;
            hold.last = last;
            hold.alive = hold.alive.min(last);
            hold.is_first = !has_renewed;
        }
    }

    /// The connections of a page break, which ends what is held. If the hand was lost before, the page can no
    /// longer report that.
    pub(crate) fn handle_break(&mut self, page: usize, now: Duration) {
        const CONNECTION: u8 = 1 << 5;
        for hold in self
            .holds
            .iter_mut()
            .filter(|it| it.page == page && it.is_lost)
        {
            hold.failed |= CONNECTION;
        }
        self.end(page, now, true);
    }

    pub(crate) fn stop(&mut self, now: Duration, page: usize, vehicle: usize) {
        self.stops.push(Stop {
            page,
            vehicle,
            at: now,
            free_since: None,
        });
    }

    /// A page is loaded anew: it repeats no stop of before.
    pub(crate) fn forget_stops(&mut self, page: usize) {
        self.stops.retain(|it| it.page != page);
    }

    pub(crate) fn forget_emergency(&mut self, vehicle: usize) {
        self.emergencies[vehicle] = false;
        self.stops.retain(|it| it.vehicle != vehicle);
    }

    pub(crate) fn forget_emergencies(&mut self) {
        self.emergencies = [false; 2];
        self.stops.clear();
    }

    /// Whether the hand of a page has moved its vehicle and still holds it.
    pub(crate) fn drives(&self, page: usize) -> bool {
        let mut holds = self.holds.iter();
        holds.any(|it| it.page == page && !it.over && it.has_moved)
    }

    /// Whether a stop has not been judged yet.
    pub(crate) const fn awaits_stops(&self) -> bool {
        !self.stops.is_empty()
    }

    /// Whether nothing more is to be seen: a rule was broken a while ago, so that the story has its end.
    pub(crate) fn is_done(&self, now: Duration) -> bool {
        self.broken.is_some() && now > self.broken_at + EPILOGUE
    }

    pub(crate) fn observe(&mut self, now: Duration, lives: &Lives, driven: [Option<Way>; 2]) {
        self.note_ways(now, lives);
        self.note_lives(now, lives);
        for (vehicle, driven) in driven.into_iter().enumerate() {
            self.judge(now, vehicle, driven, lives);
        }
        self.judge_stops(now, lives, driven);
        self.driven = driven;
        let longest = self.limit(DEAD_MAN_TWICE) + self.way([0, 1]) + lives.weather.detour;
        self.holds
            .retain(|it| !it.over || it.alive + longest + MEMORY > now);
    }

    fn note_ways(&mut self, now: Duration, lives: &Lives) {
        let pages = [0, 1].map(|page| lives.wires[page].one_way());
        let air = lives.weather.longest();
        match self.ways.last_mut() {
            Some(last) if (last.1, last.2) == (pages, air) => last.0 = now,
            _ => self.ways.push((now, pages, air)),
        }
        self.ways.retain(|(at, ..)| *at + MEMORY > now);
    }

    /// The longest time of one way from these pages to a vehicle.
    fn way<const N: usize>(&self, pages: [usize; N]) -> Duration {
        let page = self.ways.iter().flat_map(|it| pages.map(|page| it.1[page]));
        let air = self.ways.iter().map(|it| it.2);
        page.max().unwrap_or_default() + air.max().unwrap_or_default() + STEPS
    }

    fn limit(&self, time: Duration) -> Duration {
        time.div_f64(self.slowest)
    }

    fn note_lives(&mut self, now: Duration, lives: &Lives) {
        const HAND: u8 = 1;
        for hold in &mut self.holds {
            let dead = [
                hold.over,
                !lives.pages[hold.page],
                !lives.station,
                !lives.air[hold.vehicle],
                !lives.vehicles[hold.vehicle],
            ];
            let dead = (0..).zip(dead).filter(|(_, is_dead)| *is_dead);
            let dead = dead.fold(0, |dead, (part, _)| dead | 1 << part);
            if dead & !HAND == 0 {
                hold.connected = now;
            }
            if dead == 0 {
                (hold.alive, hold.failed) = (now, 0);
            } else {
                hold.failed |= dead;
            }
        }
    }

    /// Judges the motion of a vehicle.
    fn judge(&mut self, now: Duration, vehicle: usize, driven: Option<Way>, lives: &Lives) {
        for hold in self.holds.iter_mut().filter(|it| it.vehicle == vehicle) {
            if driven == Some(hold.way) && !hold.has_moved && !hold.over {
                hold.has_moved = true;
                self.moved += 1;
            }
        }
        if self.is_quiet {
            self.judge_liveness(now, vehicle, driven);
        }
        let Some(way) = driven else {
            return;
        };
        if self.emergencies[vehicle] {
            return self.break_rule(now, &format!("vehicle {vehicle} moves in emergency"));
        }
        let mut reasons = Vec::new();
        for hold in self
            .holds
            .iter()
            .filter(|it| (it.vehicle, it.way) == (vehicle, way))
        {
            let delay = self.delay_of(hold, lives);
            // A page that still waits for the next sign of a lost hand sets in motion what moves again meanwhile.
            let goes_on = self.driven[vehicle] == driven || hold.is_lost;
            // What begins was sent while the hand held, perhaps as soon as the rest of the way was there again.
            let (since, limit) = match goes_on || !is_smooth(lives) {
                true => self.limit_of(hold),
                false => (hold.last.max(hold.alive), self.limit(WAITING)),
            };
            let (silence, limit) = (now.saturating_sub(since), limit + delay);
            if silence <= limit {
                let late = silence.saturating_sub(delay);
                self.longest = self.longest.max(late);
                return;
            } else {
                let (begun, failed) = (hold.begun, hold.failed);
                reasons.push(format!(
                    "the hand that held since {begun:.2?} was last alive {silence:.3?} ago, the \
                     limit is {limit:.3?} (failed: {failed:b})"
                ));
            }
        }
        reasons.push("no other hand holds it".to_owned());
        let reasons = reasons.join("; ");
        self.break_rule(now, &format!("vehicle {vehicle} moves {way:?}: {reasons}"));
    }

    /// Where only clocks are wrong, a vehicle that is ready moves while it is held.
    fn judge_liveness(&mut self, now: Duration, vehicle: usize, driven: Option<Way>) {
        let begins = self.limit(BEGINNING) + self.way([0, 1]);
        let idle = |it: &&Hold| {
            let is_due = it.was_ready && !it.over && now > it.begun + begins;
            let is_due = is_due && it.begun > PROLOGUE;
            it.vehicle == vehicle && is_due && driven != Some(it.way)
        };
        if let Some(hold) = self.holds.iter().find(idle) {
            let (page, begun) = (hold.page, hold.begun);
            let what = format!("page {page} holds vehicle {vehicle} since {begun:.2?}");
            self.break_rule(now, &format!("{what}, and it does not move"));
        }
    }

    /// The time of one way for a hand, with what is late on it.
    fn delay_of(&self, hold: &Hold, lives: &Lives) -> Duration {
        /// Without the station or the network between it and the vehicle, no stop overtakes a setpoint that
        /// makes a detour.
        const BEYOND_PAGE: u8 = 0b1_1100;
        let way = self.way([hold.page]);
        if hold.failed & BEYOND_PAGE == 0 {
            return way;
        }
        way + lives.weather.detour
    }

    /// How long motion may last, and since when.
    fn limit_of(&self, hold: &Hold) -> (Duration, Duration) {
        let is_single = hold.failed.count_ones() <= 1;
        let limit = if is_single { DEAD_MAN } else { DEAD_MAN_TWICE };
        let first = if hold.is_first {
            FIRST_REPEAT
        } else {
            Duration::ZERO
        };
        let usual = (hold.alive, self.limit(limit + first));
        // A way that is well again after the hand was lost carries what the page still takes for a hand.
        let is_taken_up = hold.over && hold.connected >= hold.last;
        let taken_up = is_taken_up.then(|| (hold.last, self.limit(DEAD_MAN + first)));
        taken_up.map_or(usual, |it| {
            cmp::max_by_key(usual, it, |(since, limit)| *since + *limit)
        })
    }

    /// Judges emergency stops once the way to the vehicle is free: pages repeat them until then.
    fn judge_stops(&mut self, now: Duration, lives: &Lives, driven: [Option<Way>; 2]) {
        let is_free = |stop: &Stop| {
            let wire = &lives.wires[stop.page];
            let is_quick = wire.lost == 0 && wire.rate.is_none() && !lives.weather.is_lossy();
            let is_alive = lives.pages[stop.page] && lives.station;
            let is_known = lives.settled[0] && lives.settled[1 + stop.vehicle];
            let reaches = lives.live[stop.page] && lives.air[stop.vehicle] && is_known;
            is_quick && is_alive && reaches && lives.vehicles[stop.vehicle]
        };
        for mut stop in std::mem::take(&mut self.stops) {
            let since = is_free(&stop).then(|| stop.free_since.unwrap_or(now));
            stop.free_since = since;
            let pause = if since == Some(stop.at) {
                Duration::ZERO
            } else {
                REPETITION
            };
            let limit = self.limit(EMERGENCY + pause) + self.way([stop.page]);
            if since.is_none_or(|since| now <= since + limit) {
                self.stops.push(stop);
                continue;
            }
            self.emergencies_checked += 1;
            self.emergencies[stop.vehicle] = true;
            if driven[stop.vehicle].is_some() {
                let (vehicle, late) = (stop.vehicle, now - stop.at);
                self.break_rule(
                    now,
                    &format!("vehicle {vehicle} moves {late:.2?} after its stop"),
                );
            }
        }
    }

    pub(crate) fn break_rule(&mut self, now: Duration, what: &str) {
        if self.broken.is_none() {
            story::note(now, &format!("BROKEN: {what}"));
            self.broken_at = now;
            self.broken = Some(format!("at {:.3} s: {what}", now.as_secs_f64()));
        }
    }
}
