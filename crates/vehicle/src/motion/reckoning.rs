//! Velocity and dead-reckoned pose of a vehicle from wheel counts.

use std::collections::VecDeque;

use super::{Pose, Velocity, wrap};

/// Distance travelled by the wheels of each side, as reported by an odometer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelCount {
    /// Identifies the counter run: changes whenever the counter restarts at 0.
    pub start: u32,
    /// Time of the reading in milliseconds since the counter started. Wraps to 0 after 49 days.
    pub time_ms: u32,
    /// Distance travelled by the left wheels in metres, backwards negative.
    pub left: f64,
    /// Distance travelled by the right wheels in metres, backwards negative.
    pub right: f64,
    /// Distance between left and right wheels in metres.
    pub track: f64,
}

impl WheelCount {
    /// The highest plausible wheel speed in metres per second.
    const FASTEST: f64 = 50.0;

    /// Seconds since an earlier reading of the same counter run; `None` if it is of another run, or
    /// not earlier.
    #[must_use]
    pub fn seconds_since(&self, earlier: &Self) -> Option<f64> {
        let later = self.time_ms.wrapping_sub(earlier.time_ms);
        let is_later = later != 0 && later <= u32::MAX / 2;
        (self.start == earlier.start && is_later).then(|| f64::from(later) / 1000.0)
    }

    /// The motion since an earlier count; `None` if it is implausible.
    fn gone_since(&self, earlier: &Self, seconds: f64) -> Option<Gone> {
        let (left, right) = (self.left - earlier.left, self.right - earlier.right);
        let most = Self::FASTEST * seconds;
        let possible = left.abs() <= most && right.abs() <= most && self.track > 0.0;
        possible.then(|| Gone {
            forward: (left + right) / 2.0,
            turn: (left - right) / self.track,
        })
    }
}

/// A section of travel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gone {
    /// Distance forward in metres.
    pub forward: f64,
    /// Right turn in radians.
    pub turn: f64,
}

/// Computes velocity from wheel counts.
#[derive(Debug, Clone, Default)]
pub struct Speedometer {
    counts: VecDeque<WheelCount>,
}

impl Speedometer {
    /// Averaging window in seconds, to suppress the quantisation of the counter.
    const WINDOW: f64 = 0.08;
    /// Maximum number of counts kept, whatever their rate.
    const MOST: usize = 64;

    /// The velocity after another count; `None` without a count to compare with.
    pub fn handle_count(&mut self, count: WheelCount) -> Option<Velocity> {
        if self
            .counts
            .back()
            .is_some_and(|last| count.seconds_since(last).is_none())
        {
            let is_another = self
                .counts
                .back()
                .is_some_and(|last| last.start != count.start);
            if !is_another {
                return self.velocity();
            }
            self.counts.clear();
        }
        self.counts.push_back(count);
        let is_old = |second: &WheelCount| {
            count
                .seconds_since(second)
                .is_some_and(|age| age >= Self::WINDOW)
        };
        while self.counts.len() > Self::MOST || self.counts.get(1).is_some_and(is_old) {
            self.counts.pop_front();
        }
        self.velocity()
    }

    fn velocity(&self) -> Option<Velocity> {
        let (first, last) = (self.counts.front()?, self.counts.back()?);
        let seconds = last.seconds_since(first)?;
        let gone = last.gone_since(first, seconds)?;
        Some(Velocity::forward(
            gone.forward / seconds,
            gone.turn / seconds,
        ))
    }
}

/// Computes a pose by dead reckoning from wheel counts.
///
/// A counter restart is harmless: the first count after it becomes the new reference.
#[derive(Debug, Clone, Default)]
pub struct DeadReckoning {
    pose: Pose,
    last: Option<WheelCount>,
}

impl DeadReckoning {
    /// Longest turn in radians treated as a single arc.
    const LONGEST_ARC: f64 = 0.1;
    /// Maximum number of arcs per count.
    const MOST_PIECES: f64 = 100.0;

    /// Starts at a pose; the first count becomes the reference.
    #[must_use]
    pub const fn at(pose: Pose) -> Self {
        Self { pose, last: None }
    }

    /// Resumes from a pose reached at a count. Later counts of the same run are added as travel.
    #[must_use]
    pub const fn resume(pose: Pose, last: WheelCount) -> Self {
        Self {
            pose,
            last: Some(last),
        }
    }

    /// The current pose.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// The count at the current pose, after the first one.
    #[must_use]
    pub const fn count(&self) -> Option<WheelCount> {
        self.last
    }

    /// Sets the current pose. Unknown components (NaN) keep their values.
    pub fn set_pose(&mut self, pose: Pose) {
        let or = |new: f64, old: f64| if new.is_finite() { new } else { old };
        let old = self.pose;
        self.pose = Pose {
            x: or(pose.x, old.x),
            y: or(pose.y, old.y),
            z: or(pose.z, old.z),
            roll: or(pose.roll, old.roll),
            pitch: or(pose.pitch, old.pitch),
            yaw: wrap(or(pose.yaw, old.yaw)),
        };
    }

    /// Advances the pose to a count. Returns the travel since the last count.
    pub fn handle_count(&mut self, count: WheelCount) -> Gone {
        let Some(last) = self.last else {
            self.last = Some(count);
            return Gone::default();
        };
        let Some(seconds) = count.seconds_since(&last) else {
            if count.start != last.start {
                tracing::info!("wheel odometry restarted from 0; the pose is kept");
                self.last = Some(count);
            }
            return Gone::default();
        };
        self.last = Some(count);
        match count.gone_since(&last, seconds) {
            Some(gone) => {
                self.drive(gone);
                gone
            }
            None => {
                tracing::warn!(
                    ?count,
                    ?last,
                    "implausible wheel odometry ignored; the pose is kept"
                );
                Gone::default()
            }
        }
    }

    fn drive(&mut self, gone: Gone) {
        let pieces = (gone.turn.abs() / Self::LONGEST_ARC).ceil();
        let pieces = pieces.clamp(1.0, Self::MOST_PIECES);
        let (forward, turn) = (gone.forward / pieces, gone.turn / pieces);
        for _ in 0..pieces as u32 {
            // Along the chord of the arc.
            let heading = self.pose.yaw + turn / 2.0;
            self.pose.x += forward * heading.cos();
            self.pose.y += forward * heading.sin();
            self.pose.yaw = wrap(self.pose.yaw + turn);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;

    fn count(start: u32, time_ms: u32, left: f64, right: f64) -> WheelCount {
        WheelCount {
            start,
            time_ms,
            left,
            right,
            track: 0.5,
        }
    }

    #[test]
    fn a_quarter_circle_to_the_right_ends_where_it_should() {
        let mut reckoning = DeadReckoning::at(Pose::default());
        // Radius 2 m: the left wheels run on a radius of 2.25 m, the right ones on 1.75 m.
        for step in 0..=100_u32 {
            let turned = FRAC_PI_2 * f64::from(step) / 100.0;
            reckoning.handle_count(count(1, step * 20 + 1, 2.25 * turned, 1.75 * turned));
        }
        let pose = reckoning.pose();
        assert!(pose.distance(2.0, 2.0) < 0.01, "{pose:?}");
        assert!((pose.yaw - FRAC_PI_2).abs() < 1e-9);
    }

    #[test]
    fn a_count_of_a_new_counter_moves_nothing() {
        let mut reckoning = DeadReckoning::at(Pose::at(3.0, 4.0));
        reckoning.handle_count(count(1, 10, 100.0, 100.0));
        reckoning.handle_count(count(1, 1010, 101.0, 101.0));
        assert!((reckoning.pose().x - 4.0).abs() < 1e-9);
        reckoning.handle_count(count(2, 5, 0.0, 0.0));
        assert!((reckoning.pose().x - 4.0).abs() < 1e-9);
        reckoning.handle_count(count(2, 1005, 0.5, 0.5));
        assert!((reckoning.pose().x - 4.5).abs() < 1e-9);
    }

    #[test]
    fn it_goes_on_from_a_pose_and_its_count_as_if_it_had_been_there_all_the_time() {
        let mut reckoning = DeadReckoning::resume(Pose::at(1.0, 0.0), count(9, 1000, 5.0, 5.0));
        reckoning.handle_count(count(9, 3000, 7.0, 7.0));
        assert!((reckoning.pose().x - 3.0).abs() < 1e-9);
    }

    #[test]
    fn late_and_doubled_counts_change_nothing() {
        let mut reckoning = DeadReckoning::at(Pose::default());
        reckoning.handle_count(count(1, 1000, 1.0, 1.0));
        reckoning.handle_count(count(1, 2000, 2.0, 2.0));
        let pose = reckoning.pose();
        reckoning.handle_count(count(1, 1500, 1.5, 1.5));
        reckoning.handle_count(count(1, 2000, 2.0, 2.0));
        assert_eq!(reckoning.pose(), pose);
    }

    #[test]
    fn an_impossible_count_is_not_driven() {
        let mut reckoning = DeadReckoning::at(Pose::default());
        reckoning.handle_count(count(1, 1000, 0.0, 0.0));
        reckoning.handle_count(count(1, 1020, 1e9, f64::NAN));
        assert_eq!(reckoning.pose(), Pose::default());
    }

    #[test]
    fn the_clock_of_the_counter_may_begin_again_at_0() {
        let earlier = count(1, u32::MAX - 9, 0.0, 0.0);
        let later = count(1, 10, 0.0, 0.0);
        assert_eq!(later.seconds_since(&earlier), Some(0.02));
        assert_eq!(earlier.seconds_since(&later), None);
    }

    #[test]
    fn a_full_turn_on_the_spot_stays_on_the_spot() {
        let mut reckoning = DeadReckoning::at(Pose::default());
        reckoning.handle_count(count(1, 0, 0.0, 0.0));
        reckoning.handle_count(count(1, 5000, TAU * 0.25, -TAU * 0.25));
        let pose = reckoning.pose();
        assert!(pose.distance(0.0, 0.0) < 1e-9 && pose.yaw.abs() < 1e-9);
    }

    #[test]
    fn a_velocity_is_told_from_the_second_count_on_and_never_across_a_restart() {
        let mut speed = Speedometer::default();
        assert_eq!(speed.handle_count(count(1, 0, 0.0, 0.0)), None);
        let velocity = speed.handle_count(count(1, 40, 0.04, 0.02)).unwrap();
        assert!((velocity.x - 0.75).abs() < 1e-9 && (velocity.yaw - 1.0).abs() < 1e-9);
        assert_eq!(speed.handle_count(count(2, 80, 0.0, 0.0)), None);
    }

    #[test]
    fn a_velocity_forgets_what_was_before_its_window() {
        let mut speed = Speedometer::default();
        for step in 0..10_u32 {
            speed.handle_count(count(1, step * 40, f64::from(step), f64::from(step)));
        }
        let mut last = None;
        for step in 10..14_u32 {
            last = speed.handle_count(count(1, step * 40, 9.0, 9.0));
        }
        assert_eq!(last, Some(Velocity::default()));
    }
}
