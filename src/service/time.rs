//! The Time service: reports a component's time, and lets the client in control set it.
//!
//! The time is that of a clock from the application plus the correction from Set Time. The host's
//! own clock is never set, because other programs depend on it.
//!
//! # Partial Set Time messages
//!
//! * Without a date stamp, the date is the nearest one with the time stamp's day of the month. A
//!   time just after midnight, received just before midnight, means tomorrow, even at the end of a
//!   month.
//! * Without a time stamp, the time of day does not change.
//! * A day of the month that contradicts the date stamp, or is no valid day (some peers leave it
//!   0), is ignored. Any other field out of range invalidates the message.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::{Context, Handled, Hazards, Service, code_of, read};
use crate::codec::{Date, Message, Query, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::report_time::{DateStamp, TimeStamp};
use crate::messages::core::{self, QueryTime, ReportTime, SetTime};

pub(super) const DAY: i64 = 86_400_000;

/// A component's time of day: a clock and the correction from Set Time. Cheap to clone. All clones
/// share one time, so that a vehicle's reports are stamped with the time that [`Time`] reports.
#[derive(Clone)]
pub struct TimeOfDay(Arc<Corrected>);

struct Corrected {
    clock: Box<dyn Fn() -> Duration + Send + Sync>,
    /// How many milliseconds this time is ahead of the clock.
    ahead: AtomicI64,
}

impl TimeOfDay {
    /// Uses `clock`, which returns the time since the beginning of 1970 (UTC).
    #[must_use]
    pub fn new(clock: impl Fn() -> Duration + Send + Sync + 'static) -> Self {
        Self(Arc::new(Corrected {
            clock: Box::new(clock),
            ahead: AtomicI64::new(0),
        }))
    }

    /// The time since the beginning of 1970 (UTC); 0 if it was set to an earlier time.
    #[must_use]
    pub fn now(&self) -> Duration {
        let clock = (self.0.clock)();
        let ahead = Duration::from_millis(self.ahead().unsigned_abs());
        if self.ahead() < 0 {
            clock.saturating_sub(ahead)
        } else {
            clock.saturating_add(ahead)
        }
    }

    /// [`now`](Self::now) as the time of a sample, as `Component::publish` takes it.
    #[must_use]
    pub fn system_time(&self) -> SystemTime {
        UNIX_EPOCH + self.now()
    }

    /// How many milliseconds it is ahead of its clock.
    #[must_use]
    pub fn ahead(&self) -> i64 {
        self.0.ahead.load(Ordering::Relaxed)
    }

    /// Milliseconds since the beginning of 1970; the message fields end in 2127.
    fn milliseconds(&self) -> i64 {
        self.by_the_clock().saturating_add(self.ahead())
    }

    fn by_the_clock(&self) -> i64 {
        i64::try_from((self.0.clock)().as_millis()).unwrap_or(i64::MAX)
    }

    /// Sets the time to `wanted`, in milliseconds since the beginning of 1970.
    fn set(&self, wanted: i64) {
        let ahead = wanted.saturating_sub(self.by_the_clock());
        self.0.ahead.store(ahead, Ordering::Relaxed);
    }
}

impl std::fmt::Debug for TimeOfDay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TimeOfDay")
            .field("ahead", &self.ahead())
            .finish_non_exhaustive()
    }
}

/// Answers Query Time (2011h), and obeys Set Time (0011h) from the client in control, in any state
/// of the component.
///
/// ```
/// use std::time::{SystemTime, UNIX_EPOCH};
/// use jaus::service::{Time, TimeOfDay};
///
/// let clock = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
/// let time = Time::new(TimeOfDay::new(clock));
/// ```
#[derive(Debug)]
pub struct Time {
    time: TimeOfDay,
}

impl Time {
    /// Reports `time`, and sets it for all its clones.
    #[must_use]
    pub const fn new(time: TimeOfDay) -> Self {
        Self { time }
    }

    fn report(&self, query: &QueryTime) -> ReportTime {
        let now = self.time.milliseconds();
        let mut report = ReportTime {
            time_stamp: time_stamp(now),
            date_stamp: date_stamp(now),
        };
        query.drop_unrequested(&mut report);
        report
    }

    /// Returns whether the message gives a valid time.
    fn set(&self, set: &SetTime) -> bool {
        let Some(wanted) = wanted(self.time.milliseconds(), set) else {
            return false;
        };
        self.time.set(wanted);
        true
    }
}

impl Service for Time {
    fn offers(&self) -> Vec<ServiceId> {
        vec![core::time::V1_1, core::time::V1_0]
    }

    fn hazards(&self) -> Hazards {
        Hazards {
            set_up_by: Some(SetTime::NAME),
            ..Hazards::default()
        }
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(QueryTime::CODE) => {
                if let Some(query) = read::<QueryTime>(message) {
                    context.reply(message, &self.report(&query));
                }
            }
            Some(SetTime::CODE) => {
                let source = message.source;
                if !context.standing().obeys(source) {
                    tracing::debug!(%source, "time not set: sender not in control");
                } else if let Some(set) = read::<SetTime>(message) {
                    if self.set(&set) {
                        context.changed::<QueryTime>();
                    } else {
                        tracing::debug!(%source, ?set, "time not set: invalid time");
                    }
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }
}

/// The time that a message sets, in milliseconds since the beginning of 1970.
fn wanted(now: i64, set: &SetTime) -> Option<i64> {
    let of_day = match set.time_stamp {
        Some(stamp) => milliseconds_of_day(stamp)?,
        None => now.rem_euclid(DAY),
    };
    let day = match (set.date_stamp, set.time_stamp) {
        (Some(date), _) => day_of(date)?,
        (None, Some(stamp)) => nearest_day(now, of_day, stamp.day()),
        (None, None) => now.div_euclid(DAY),
    };
    Some(day * DAY + of_day)
}

pub(super) fn milliseconds_of_day(stamp: TimeStamp) -> Option<i64> {
    let [hour, minutes, seconds] = [stamp.hour(), stamp.minutes(), stamp.seconds()].map(i64::from);
    let milliseconds = i64::from(stamp.milliseconds());
    let real = hour < 24 && minutes < 60 && seconds < 60 && milliseconds < 1000;
    real.then_some(((hour * 60 + minutes) * 60 + seconds) * 1000 + milliseconds)
}

/// Days after 1 January 1970.
fn day_of(stamp: DateStamp) -> Option<i64> {
    let date = Date {
        year: 2000 + u64::from(stamp.year()),
        month: stamp.month().into(),
        day: stamp.day().into(),
    };
    date.days_after_1970()
        .and_then(|days| i64::try_from(days).ok())
}

/// The day of a report, in days after 1 January 1970. A peer that reads its clock twice may send
/// the date of one side of midnight and the time of the other; the time's day of the month then
/// counts.
pub(super) fn reported_day(date: DateStamp, time: TimeStamp) -> Option<i64> {
    let day = day_of(date)?;
    let is_of_time =
        |day: &i64| date_on(*day).is_some_and(|date| date.day == u64::from(time.day()));
    let nearest = [day, day - 1, day + 1].into_iter().find(is_of_time);
    Some(nearest.unwrap_or(day))
}

/// The day closest to now with this day of the month; today if there is none.
pub(super) fn nearest_day(now: i64, of_day: i64, number: u8) -> i64 {
    let today = now.div_euclid(DAY);
    // One of any two consecutive months has this day, so the range contains it.
    (today - 61..=today + 61)
        .filter(|&day| date_on(day).is_some_and(|date| date.day == u64::from(number)))
        .min_by_key(|&day| (day * DAY + of_day).abs_diff(now))
        .unwrap_or(today)
}

fn date_on(day: i64) -> Option<Date> {
    u64::try_from(day).ok().map(Date::after_1970)
}

pub(super) fn time_stamp(now: i64) -> Option<TimeStamp> {
    let since_1970 = Duration::from_millis(u64::try_from(now).ok()?);
    Some(TimeStamp::at(since_1970))
}

/// `None` before 2000 and after 2127, which the field cannot hold.
pub(super) fn date_stamp(now: i64) -> Option<DateStamp> {
    let date = date_on(now.div_euclid(DAY))?;
    let stamp = DateStamp::default();
    let stamp = stamp.with_day(u8::try_from(date.day).ok()?).ok()?;
    let stamp = stamp.with_month(u8::try_from(date.month).ok()?).ok()?;
    let year = u8::try_from(date.year.checked_sub(2000)?).ok()?;
    stamp.with_year(year).ok()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::service::State;
    use crate::service::rig::{CLIENT, Rig, STRANGER};

    /// 2024-02-28 23:59:58.250.
    const BEFORE_MIDNIGHT: u64 = 1_709_164_798_250;

    /// A component whose clock shows `milliseconds`.
    fn rig(milliseconds: u64) -> (Rig, Arc<AtomicU64>) {
        let clock = Arc::new(AtomicU64::new(milliseconds));
        let read = clock.clone();
        let time = move || Duration::from_millis(read.load(Ordering::Relaxed));
        let time = Time::new(TimeOfDay::new(time));
        (Rig::new(vec![Box::new(time)]), clock)
    }

    fn at(day: u8, hour: u8, minutes: u8) -> TimeStamp {
        let stamp = TimeStamp::default().with_day(day).unwrap_or_default();
        let stamp = stamp.with_hour(hour).unwrap();
        stamp.with_minutes(minutes).unwrap()
    }

    fn on(year: u8, month: u8, day: u8) -> DateStamp {
        let stamp = DateStamp::default().with_year(year).unwrap();
        stamp.with_month(month).unwrap().with_day(day).unwrap()
    }

    fn set(time_stamp: Option<TimeStamp>, date_stamp: Option<DateStamp>) -> SetTime {
        SetTime {
            time_stamp,
            date_stamp,
        }
    }

    fn shown(rig: &mut Rig) -> (DateStamp, TimeStamp) {
        let report: ReportTime = rig.ask(&QueryTime::all()).unwrap();
        (report.date_stamp.unwrap(), report.time_stamp.unwrap())
    }

    #[test]
    fn the_time_is_the_clocks() {
        let (mut rig, clock) = rig(BEFORE_MIDNIGHT);
        let (date, time) = shown(&mut rig);
        assert_eq!(date, on(24, 2, 28));
        assert_eq!((time.day(), time.hour(), time.minutes()), (28, 23, 59));
        assert_eq!((time.seconds(), time.milliseconds()), (58, 250));
        clock.fetch_add(2000, Ordering::Relaxed);
        let (date, time) = shown(&mut rig);
        assert_eq!((date, time.day(), time.hour()), (on(24, 2, 29), 29, 0));
    }

    #[test]
    fn a_report_has_what_was_asked_for_and_nothing_else() {
        let (mut rig, _) = rig(BEFORE_MIDNIGHT);
        for presence_vector in 0..=4 {
            let report: ReportTime = rig.ask(&QueryTime { presence_vector }).unwrap();
            assert_eq!(report.time_stamp.is_some(), presence_vector & 1 != 0);
            assert_eq!(report.date_stamp.is_some(), presence_vector & 2 != 0);
        }
    }

    #[test]
    fn the_client_in_control_sets_the_time_and_it_goes_on_from_there() {
        let (mut rig, clock) = rig(BEFORE_MIDNIGHT);
        rig.stand(State::Standby, Some(CLIENT));
        rig.send(CLIENT, &set(Some(at(1, 12, 30)), Some(on(30, 12, 1))));
        assert!(rig.changed().contains(&QueryTime::CODE));
        assert_eq!(shown(&mut rig), (on(30, 12, 1), at(1, 12, 30)));
        clock.fetch_add(60_000, Ordering::Relaxed);
        assert_eq!(shown(&mut rig), (on(30, 12, 1), at(1, 12, 31)));
    }

    #[test]
    fn nobody_else_sets_it() {
        let (mut rig, _) = rig(BEFORE_MIDNIGHT);
        let before = shown(&mut rig);
        rig.send(STRANGER, &set(None, Some(on(30, 12, 1))));
        rig.stand(State::Ready, None);
        rig.send(CLIENT, &set(None, Some(on(30, 12, 1))));
        assert_eq!(shown(&mut rig), before);
        assert!(rig.changed().is_empty());
    }

    #[test]
    fn a_time_without_a_date_is_on_the_nearest_such_day() {
        for (stamp, date) in [
            (at(29, 0, 0), on(24, 2, 29)),
            (at(28, 0, 0), on(24, 2, 28)),
            (at(1, 0, 0), on(24, 3, 1)),
            (at(31, 0, 0), on(24, 1, 31)),
            // Not a valid day: today.
            (at(0, 0, 0), on(24, 2, 28)),
        ] {
            let (mut rig, _) = rig(BEFORE_MIDNIGHT);
            rig.send(CLIENT, &set(Some(stamp), None));
            assert_eq!(shown(&mut rig).0, date, "{stamp:?}");
        }
    }

    #[test]
    fn a_date_without_a_time_leaves_the_time_of_day() {
        let (mut rig, _) = rig(BEFORE_MIDNIGHT);
        rig.send(CLIENT, &set(None, Some(on(127, 12, 31))));
        let (date, time) = shown(&mut rig);
        assert_eq!((date, time.hour()), (on(127, 12, 31), 23));
    }

    #[test]
    fn what_is_no_time_is_ignored() {
        let (mut rig, _) = rig(BEFORE_MIDNIGHT);
        let before = shown(&mut rig);
        for void in [
            set(None, Some(on(23, 2, 29))),
            set(None, Some(DateStamp(0))),
            set(Some(TimeStamp(u32::MAX)), Some(on(30, 1, 1))),
            set(None, None),
        ] {
            rig.send(CLIENT, &void);
            assert_eq!(shown(&mut rig), before, "{void:?}");
        }
    }
}
