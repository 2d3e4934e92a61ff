//! The pose on the globe from satellite positions, turn rates and wheel travel: an extended Kalman
//! filter for position, heading and the bias of the gyroscope.
//!
//! | input | effect |
//! |---|---|
//! | wheel travel | moves the position along the heading; turns the heading if there is no gyroscope |
//! | turn rate | turns the heading; at rest it shows the bias |
//! | position | corrects the position, and through its history also the heading |
//! | course | sets the heading, then corrects it; only above 0.5 m/s and not in tight turns |
//!
//! An outlier is rejected: an input that the estimate makes improbable. What rejected positions say
//! counts as uncertainty until they end. If they last and agree with each other, the estimate was
//! wrong, and it starts again from them. Time without input makes the estimate uncertain, and old: [`Estimate::sampled_at`]
//! advances only with measured motion.

use std::time::{Duration, Instant};

use super::{Course, Fix};
use crate::motion::{Frame, GlobalPose, Gone, Pose, wrap};

/// The pose at one time, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The pose. The yaw is NaN while the heading is unknown.
    pub pose: GlobalPose,
    /// Standard deviation of the horizontal position in metres.
    pub position_rms: f64,
    /// Standard deviation of the heading in radians; NaN while it is unknown.
    pub heading_rms: f64,
    /// Time of the newest input that determines the position.
    pub sampled_at: Instant,
    /// Time of the last accepted position.
    pub fixed_at: Instant,
}

/// Fuses the inputs. Times are those of the measurements.
#[derive(Debug, Default)]
pub struct Estimator {
    state: Option<State>,
    /// The last turn rate in radians per second, and its time.
    rate: Option<(Instant, f64)>,
    /// The last wheel travel.
    travel: Option<(Instant, Gone)>,
    /// What the wheels have turned since the last turn rate, in radians.
    unseen_turn: f64,
    /// Time of the last accepted position.
    fixed_at: Option<Instant>,
    /// Standard deviation of the last accepted position in metres.
    deviation: f64,
    /// Time of the last position, accepted or not.
    seen_at: Option<Instant>,
    /// Time of the last input that shows the heading.
    turned_at: Option<Instant>,
    /// Distance driven since the last position, accepted or not, in metres.
    driven: f64,
    /// Rejected positions: north and east in the frame.
    positions: Outliers<[f64; 2]>,
    /// Rejected headings.
    courses: Outliers<f64>,
}

const NORTH: usize = 0;
const EAST: usize = 1;
const YAW: usize = 2;
const BIAS: usize = 3;

/// Estimate and covariance of north, east (metres), yaw (radians) and gyroscope bias (radians per
/// second) in a frame whose X axis points north.
#[derive(Debug, Clone)]
struct State {
    frame: Frame,
    values: [f64; 4],
    covariance: [[f64; 4]; 4],
    /// Whether the heading is known at all.
    has_heading: bool,
}

/// Consecutive rejected inputs of one kind that agree with each other.
#[derive(Debug, Default)]
struct Outliers<T> {
    /// Time of the first one.
    since: Option<Instant>,
    /// The last one, and its time.
    last: Option<(Instant, T)>,
    /// Distance of the last one from the estimate.
    distance: f64,
}

impl<T: Default> Outliers<T> {
    /// Rejected inputs that last this long are right.
    const LIMIT: Duration = Duration::from_secs(5);
    /// Inputs further apart are not consecutive. A receiver reports at least once a second.
    const GAP: Duration = Duration::from_millis(1500);

    /// Notes an outlier. `agrees` compares it with the last one, so many seconds before. Returns
    /// whether the estimate must give way.
    fn reject(
        &mut self,
        now: Instant,
        value: T,
        distance: f64,
        agrees: impl FnOnce(&T, f64) -> bool,
    ) -> bool {
        let goes_on = self.last.as_ref().is_some_and(|(at, last)| {
            let gap = now.saturating_duration_since(*at);
            gap <= Self::GAP && agrees(last, gap.as_secs_f64())
        });
        let since = self.since.filter(|_| goes_on).unwrap_or(now);
        let is_right = now.saturating_duration_since(since) >= Self::LIMIT;
        *self = match is_right {
            true => Self::default(),
            false => Self {
                since: Some(since),
                last: Some((now, value)),
                distance,
            },
        };
        is_right
    }
}

impl Estimator {
    /// A turn rate is valid for this long.
    const RATE_AGE: Duration = Duration::from_millis(200);
    /// Wheel travel is valid for this long.
    const TRAVEL_AGE: Duration = Duration::from_millis(500);
    /// A course is used from this speed on, in metres per second.
    const COURSE_SPEED: f64 = 0.5;
    /// A course is used up to this turn rate, in radians per second.
    const COURSE_RATE: f64 = 0.3;
    /// Speed of a vehicle without wheel travel, in metres per second, as process noise.
    const UNKNOWN_SPEED: f64 = 3.0;
    /// Turn rate of a vehicle without wheel travel and gyroscope, in radians per second, as process
    /// noise.
    const UNKNOWN_RATE: f64 = 0.5;
    /// Standard deviation of wheel travel, in metres per square root of a metre.
    const SLIP: f64 = 0.05;
    /// Standard deviation of a heading without gyroscope, in radians per square root of a metre, and
    /// of a radian.
    const WANDER: f64 = 0.02;
    /// Noise of the gyroscope in radians per square root of a second.
    const RATE_NOISE: f64 = 0.005;
    /// Initial standard deviation of the bias, and its drift per square root of a second, in radians
    /// per second.
    const BIAS: (f64, f64) = (0.02, 0.0002);
    /// Largest innovation, in variances: one in a thousand of two degrees of freedom, and of one.
    const GATES: (f64, f64) = (13.8, 10.8);
    /// The frame is moved when the vehicle is this many metres from its origin.
    const FRAME: f64 = 5000.0;

    /// Handles the travel of the wheels since the last call.
    pub fn handle_travel(&mut self, now: Instant, gone: Gone) {
        if !gone.forward.is_finite() || !gone.turn.is_finite() {
            return;
        }
        self.travel = Some((now, gone));
        self.turned_at = Some(now);
        self.driven += gone.forward.abs();
        let has_rate = self.rate(now).is_some();
        let Some(state) = &mut self.state else {
            return;
        };
        self.unseen_turn += gone.turn;
        if !has_rate {
            // Without a gyroscope, or after its last rate: the turn since then counts too.
            let turn = std::mem::take(&mut self.unseen_turn);
            let wander = Self::WANDER.powi(2) * (gone.forward.abs() + turn.abs());
            state.turn(turn, wander);
        }
        state.drive(gone.forward);
    }

    /// Handles a turn rate in radians per second, right positive.
    pub fn handle_rate(&mut self, now: Instant, rate: f64) {
        if !rate.is_finite() {
            return;
        }
        let before = self.rate.replace((now, rate));
        self.turned_at = Some(now);
        self.unseen_turn = 0.0;
        let Some(seconds) = before
            .map(|(at, _)| now.saturating_duration_since(at))
            .filter(|age| *age <= Self::RATE_AGE)
            .map(|age| age.as_secs_f64())
        else {
            return;
        };
        let is_at_rest = self.is_at_rest(now);
        if let Some(state) = &mut self.state {
            state.turn_at(rate, seconds);
            if is_at_rest {
                let variance = Self::RATE_NOISE.powi(2) / seconds.max(1e-3);
                state.correct(BIAS, rate - state.values[BIAS], variance);
            }
        }
    }

    /// Handles a position.
    pub fn handle_fix(&mut self, now: Instant, fix: &Fix) {
        let variance = fix.deviation().powi(2);
        let global = GlobalPose {
            latitude: fix.latitude,
            longitude: fix.longitude,
            ..GlobalPose::default()
        };
        let blind = self.blind(now);
        let driven = std::mem::take(&mut self.driven);
        self.seen_at = Some(now);
        let Some(state) = &mut self.state else {
            self.state = Some(State::new(fix, variance));
            self.accept(now, fix);
            return;
        };
        // Without wheel travel the vehicle may have gone anywhere since.
        state.spread((Self::UNKNOWN_SPEED * blind).powi(2));
        let place = state.frame.to_local(&global);
        let missed = [place.x - state.values[NORTH], place.y - state.values[EAST]];
        let distance = missed[0].hypot(missed[1]);
        if state.improbability(missed, variance) > Self::GATES.0 {
            // The vehicle is seen where it was rejected before, or where it can have driven since.
            let agrees = |last: &[f64; 2], seconds: f64| {
                let moved = 2.0 * variance + (Self::UNKNOWN_SPEED * seconds).powi(2);
                let apart = (place.x - last[0]).hypot(place.y - last[1]);
                apart <= driven + (Self::GATES.0 * moved).sqrt()
            };
            let seen = [place.x, place.y];
            if self.positions.reject(now, seen, distance, agrees) {
                tracing::warn!(metres = distance, "the position was wrong; it starts again");
                state.place((place.x, place.y), variance);
                self.accept(now, fix);
            }
            return;
        }
        self.positions = Outliers::default();
        state.correct(NORTH, missed[0], variance);
        // The first correction also moves the east.
        let east = place.y - state.values[EAST];
        state.correct(EAST, east, variance);
        if let Some(altitude) = fix.altitude {
            state.frame.altitude = altitude;
        }
        state.move_frame();
        self.accept(now, fix);
    }

    fn accept(&mut self, now: Instant, fix: &Fix) {
        self.fixed_at = Some(now);
        self.deviation = fix.deviation();
    }

    /// Handles a course over ground.
    pub fn handle_course(&mut self, now: Instant, course: &Course) {
        let turns = self
            .rate(now)
            .is_some_and(|rate| rate.abs() > Self::COURSE_RATE);
        let is_back = self.forward(now).is_some_and(|forward| forward < 0.0);
        let before = self.turned_at.unwrap_or(now);
        self.turned_at = Some(before.max(now));
        let blind = now.saturating_duration_since(before).as_secs_f64();
        let Some(state) = &mut self.state else {
            return;
        };
        if course.speed < Self::COURSE_SPEED || turns {
            return;
        }
        let reversed = if is_back { std::f64::consts::PI } else { 0.0 };
        let heading = wrap(course.direction + reversed);
        let variance = (0.1 / course.speed).powi(2) + 0.02_f64.powi(2);
        if !state.has_heading {
            state.head(heading, variance);
            return;
        }
        // Without wheel travel and gyroscope the vehicle may have turned since.
        state.covariance[YAW][YAW] += (Self::UNKNOWN_RATE * blind).powi(2);
        let missed = wrap(heading - state.values[YAW]);
        if missed.powi(2) > Self::GATES.1 * (variance + state.covariance[YAW][YAW]) {
            let agrees = |last: &f64, seconds: f64| {
                let turned = 2.0 * variance + (Self::UNKNOWN_RATE * seconds).powi(2);
                wrap(heading - last).powi(2) <= Self::GATES.1 * turned
            };
            if self.courses.reject(now, heading, missed.abs(), agrees) {
                tracing::warn!(radians = missed, "the heading was wrong; it starts again");
                state.head(heading, variance);
            }
            return;
        }
        self.courses = Outliers::default();
        state.correct(YAW, missed, variance);
    }

    /// Sets the heading in radians from north, as a person knows it.
    pub fn set_heading(&mut self, heading: f64) {
        if let Some(state) = self.state.as_mut().filter(|_| heading.is_finite()) {
            state.head(heading, 0.1_f64.powi(2));
        }
    }

    /// The pose; `None` before the first position.
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        let state = self.state.as_ref()?;
        let [north, east, yaw, _] = state.values;
        let (yaw, variance) = match state.has_heading {
            true => (yaw, state.covariance[YAW][YAW]),
            false => (f64::NAN, f64::NAN),
        };
        let pose = state.frame.to_global(&Pose {
            yaw,
            ..Pose::at(north, east)
        });
        let own = (state.covariance[NORTH][NORTH] + state.covariance[EAST][EAST]).sqrt();
        // The errors of consecutive positions are alike: no mean of them is better than one.
        let rms = own.hypot(self.deviation);
        let doubt = self
            .positions
            .since
            .map_or(0.0, |_| self.positions.distance);
        let travelled_at = self.travel.map(|(at, _)| at).filter(|_| state.has_heading);
        let fixed_at = self.fixed_at?;
        Some(Estimate {
            pose,
            position_rms: rms.max(doubt),
            heading_rms: variance.sqrt(),
            sampled_at: travelled_at.map_or(fixed_at, |at| at.max(fixed_at)),
            fixed_at,
        })
    }

    fn rate(&self, now: Instant) -> Option<f64> {
        let (at, rate) = self.rate?;
        (now.saturating_duration_since(at) <= Self::RATE_AGE).then_some(rate)
    }

    /// The last distance driven, if it is recent.
    fn forward(&self, now: Instant) -> Option<f64> {
        let (at, gone) = self.travel?;
        (now.saturating_duration_since(at) <= Self::TRAVEL_AGE).then_some(gone.forward)
    }

    fn is_at_rest(&self, now: Instant) -> bool {
        let recent = self.travel.filter(|_| self.forward(now).is_some());
        recent.is_some_and(|(_, gone)| gone == Gone::default())
    }

    /// Seconds since the last position without usable wheel travel.
    fn blind(&self, now: Instant) -> f64 {
        let has_heading = self.state.as_ref().is_some_and(|it| it.has_heading);
        let travelled_at = self.travel.map(|(at, _)| at).filter(|_| has_heading);
        let last = self.seen_at.max(travelled_at);
        let since = last.map(|at| now.saturating_duration_since(at));
        since.map_or(0.0, |since| since.as_secs_f64())
    }
}

impl State {
    fn new(fix: &Fix, variance: f64) -> Self {
        let mut state = Self {
            frame: Frame {
                altitude: fix.altitude.unwrap_or(f64::NAN),
                ..Frame::at(fix.latitude, fix.longitude)
            },
            values: [0.0; 4],
            covariance: [[0.0; 4]; 4],
            has_heading: false,
        };
        state.place((0.0, 0.0), variance);
        state.covariance[BIAS][BIAS] = Estimator::BIAS.0.powi(2);
        state
    }

    /// Sets the position, independently of the other values.
    fn place(&mut self, (north, east): (f64, f64), variance: f64) {
        self.reset(NORTH, north, variance);
        self.reset(EAST, east, variance);
    }

    /// Sets the heading, independently of the other values.
    fn head(&mut self, heading: f64, variance: f64) {
        self.reset(YAW, wrap(heading), variance);
        self.has_heading = true;
    }

    fn reset(&mut self, index: usize, value: f64, variance: f64) {
        self.values[index] = value;
        for other in 0..4 {
            self.covariance[index][other] = 0.0;
            self.covariance[other][index] = 0.0;
        }
        self.covariance[index][index] = variance;
    }

    /// Drives a distance along the heading, if it is known.
    fn drive(&mut self, forward: f64) {
        if !self.has_heading {
            return;
        }
        let (sin, cos) = self.values[YAW].sin_cos();
        self.values[NORTH] += forward * cos;
        self.values[EAST] += forward * sin;
        self.depend(NORTH, YAW, -forward * sin);
        self.depend(EAST, YAW, forward * cos);
        self.spread(Estimator::SLIP.powi(2) * forward.abs());
    }

    /// Turns by an angle with this variance.
    fn turn(&mut self, angle: f64, variance: f64) {
        self.values[YAW] = wrap(self.values[YAW] + angle);
        self.covariance[YAW][YAW] += variance;
    }

    /// Turns for some seconds at a measured rate, less the bias.
    fn turn_at(&mut self, rate: f64, seconds: f64) {
        let noise = Estimator::RATE_NOISE.powi(2) * seconds;
        self.turn((rate - self.values[BIAS]) * seconds, noise);
        self.depend(YAW, BIAS, -seconds);
        self.covariance[BIAS][BIAS] += Estimator::BIAS.1.powi(2) * seconds;
    }

    /// Applies to the covariance that `value += factor * of` in the prediction.
    fn depend(&mut self, value: usize, of: usize, factor: f64) {
        for column in 0..4 {
            self.covariance[value][column] += factor * self.covariance[of][column];
        }
        for row in &mut self.covariance {
            row[value] += factor * row[of];
        }
    }

    /// Makes the position less certain.
    fn spread(&mut self, variance: f64) {
        self.covariance[NORTH][NORTH] += variance;
        self.covariance[EAST][EAST] += variance;
    }

    /// The squared distance of a position from the estimate, in variances.
    fn improbability(&self, [north, east]: [f64; 2], variance: f64) -> f64 {
        let (a, d) = (
            self.covariance[NORTH][NORTH] + variance,
            self.covariance[EAST][EAST] + variance,
        );
        let b = self.covariance[NORTH][EAST];
        let determinant = a * d - b * b;
        (d * north * north - 2.0 * b * north * east + a * east * east) / determinant
    }

    /// Corrects all values by a measurement of one of them, which `missed` the estimate.
    fn correct(&mut self, index: usize, missed: f64, variance: f64) {
        let row = self.covariance[index];
        let total = row[index] + variance;
        for (value, covariance) in self.values.iter_mut().zip(row) {
            *value += covariance / total * missed;
        }
        self.values[YAW] = wrap(self.values[YAW]);
        for (own, line) in row.iter().zip(&mut self.covariance) {
            for (cell, other) in line.iter_mut().zip(row) {
                *cell -= own / total * other;
            }
        }
    }

    /// Keeps the frame near the vehicle, where it is accurate.
    fn move_frame(&mut self) {
        let [north, east, ..] = self.values;
        if north.hypot(east) > Estimator::FRAME {
            let here = self.frame.to_global(&Pose::at(north, east));
            self.frame.latitude = here.latitude;
            self.frame.longitude = here.longitude;
            self.values[NORTH] = 0.0;
            self.values[EAST] = 0.0;
        }
    }
}
