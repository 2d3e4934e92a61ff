//! The link between the station and one page: how old the picture is that the operator drives by,
//! how long setpoints wait on the way, and how many states may be under way.
//!
//! The page confirms every state that it shows, and says how long ago it arrived. The time from sending
//! a state to its confirmation, without the time on the page, is a round trip. The shortest one of
//! the last 10 s is that of an idle link; what a frame takes beyond it, it has waited.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use jaus::service::MOST_SLEW;
use serde::{Deserialize, Serialize};

/// The last state that the operator has seen, as a page reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Seen {
    /// Number of the state.
    #[serde(rename = "seen")]
    pub seq: u64,
    /// How long ago it arrived at the page, in milliseconds.
    pub held_ms: u64,
}

/// Why a setpoint is too old to drive a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TooOld {
    /// The page names no state of the vehicle that it has shown.
    #[error("the page has not confirmed what it shows")]
    Unseen,
    /// Even without waiting, the picture is too old.
    #[error("the link to the page is too slow to drive by: a round trip takes {:.1} s", .0.as_secs_f64())]
    SlowLink(Duration),
    /// The picture that the operator has seen.
    #[error("the operator's picture is {:.1} s old", .0.as_secs_f64())]
    Picture(Duration),
    /// The setpoint was held up.
    #[error("the command was {:.1} s late", .0.as_secs_f64())]
    Late(Duration),
}

/// What the station has measured of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct PageLinkQuality {
    /// Median of the round trips of the last 10 s, in milliseconds.
    pub round_trip_ms: Option<u64>,
    /// Share of them that took 150 ms longer than the shortest, as after the loss of a packet.
    pub loss_percent: Option<u8>,
    /// Whether a confirmation has arrived within the last second.
    pub way_back: bool,
}

/// The link to one page.
#[derive(Debug)]
pub struct PageLink {
    /// The last state confirmed, and those sent since, oldest first.
    sent: VecDeque<SentState>,
    /// The last state whose arrival is confirmed.
    arrived: Option<u64>,
    /// When a confirmation last arrived.
    heard: Option<Instant>,
    samples: VecDeque<Sample>,
    /// The round trip of the idle link, by which states are paced, and when it was measured. It follows
    /// a longer one slowly: a link that is never idle looks like a long one.
    idle: Option<Sample>,
    /// How many states may be under way.
    window: usize,
    /// Until then the window does not grow.
    hold_until: Option<Instant>,
    /// How many confirmations in a row were late.
    late: u32,
    /// Least time between frames, and when the last one was sent.
    pause: Duration,
    last: Option<Instant>,
}

#[derive(Debug, Clone, Copy)]
struct SentState {
    seq: u64,
    vehicle: Option<u16>,
    at: Instant,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    at: Instant,
    round_trip: Duration,
}

impl Default for PageLink {
    fn default() -> Self {
        Self {
            sent: VecDeque::new(),
            arrived: None,
            heard: None,
            samples: VecDeque::new(),
            idle: None,
            window: 1,
            hold_until: None,
            late: 0,
            pause: Duration::ZERO,
            last: None,
        }
    }
}

impl PageLink {
    /// Greatest age of a picture beyond the round trip, and greatest time that a setpoint waits.
    pub const SLACK: Duration = Duration::from_millis(300);
    /// Greatest age of a picture, whatever the link.
    pub const OLDEST: Duration = Duration::from_secs(1);
    /// For how long a round trip counts.
    const MEMORY: Duration = Duration::from_secs(10);
    /// A round trip that is longer than the shortest by this has met a queue or a loss.
    const DELAYED: Duration = Duration::from_millis(150);
    /// Up to this the link has no queue.
    const PROMPT: Duration = Duration::from_millis(50);
    /// After a queue, for this time no more states are sent at once.
    const CAUTION: Duration = Duration::from_secs(2);
    /// So many late confirmations in a row are no single loss.
    const QUEUED: u32 = 2;
    /// A link that queues rests for so many times the delay after each frame.
    const PAUSE: u32 = 3;
    const LONGEST_PAUSE: Duration = Duration::from_secs(5);
    /// The idle link's round trip grows by this part of the time at most: 10 ms in a second.
    const FOLLOWS: u32 = 100;
    /// Interval of states.
    const PERIOD: Duration = Duration::from_millis(100);
    /// So many more are under way while their confirmations wait for the next setpoint, and for the page
    /// to draw.
    const CONFIRMING: usize = 2;
    /// Most states under way: those of one second, and these.
    const MOST_UNDER_WAY: usize = 10 + Self::CONFIRMING;
    /// Most round trips kept.
    const MOST_SAMPLES: usize = 256;
    /// The page's clock runs so many times as fast as the station's at most: one is slewed forward while
    /// the other one is slewed back.
    const SLEW: f64 = (1.0 + MOST_SLEW) / (1.0 - MOST_SLEW);
    /// Without a confirmation for this time, the way back does not work.
    const SILENCE: Duration = Duration::from_secs(1);

    /// Whether the link takes another frame now. One state is under way at a time, and more only where
    /// that does not make them wait: on a long link without a queue. On a link that queues they come
    /// seldom, because what else the page says must not wait behind confirmations.
    #[must_use]
    pub fn may_send(&self, now: Instant) -> bool {
        self.under_way() < self.window && self.left(now).is_zero()
    }

    /// How long the link still has to rest after the last frame.
    #[must_use]
    pub fn left(&self, now: Instant) -> Duration {
        let next = self.last.map_or(now, |it| it + self.pause);
        next.saturating_duration_since(now)
    }

    fn under_way(&self) -> usize {
        let is_under_way = |it: &&SentState| self.arrived.is_none_or(|arrived| it.seq > arrived);
        self.sent.iter().filter(is_under_way).count()
    }

    /// Notes that a state of `vehicle` is sent.
    pub fn handle_sent(&mut self, now: Instant, seq: u64, vehicle: Option<u16>) {
        self.sent.push_back(SentState {
            seq,
            vehicle,
            at: now,
        });
        self.handle_frame(now);
    }

    /// Notes that a frame is sent which the page does not confirm.
    pub const fn handle_frame(&mut self, now: Instant) {
        self.last = Some(now);
    }

    /// Handles the confirmation of a state that has arrived, but is not shown.
    pub fn handle_received(&mut self, now: Instant, seq: u64) {
        if self.sent.iter().any(|it| it.seq == seq) {
            self.heard = Some(now);
            self.arrived = self.arrived.max(Some(seq));
            self.sent.retain(|it| it.seq >= seq);
        }
    }

    /// Handles the confirmation of a state that is shown.
    ///
    /// # Errors
    /// [`TooOld::Unseen`] if the page cannot have shown it for so long.
    pub fn handle_seen(&mut self, now: Instant, seen: Seen) -> Result<(), TooOld> {
        self.measure(now, seen).map(|_| ())
    }

    /// Judges a setpoint for `vehicle`. Returns the time that it has waited on the way.
    ///
    /// # Errors
    /// If it is too old to drive by.
    pub fn handle_setpoint(
        &mut self,
        now: Instant,
        seen: Seen,
        vehicle: Option<u16>,
    ) -> Result<Duration, TooOld> {
        let (state, round_trip) = self.measure(now, seen)?;
        if state.vehicle != vehicle {
            return Err(TooOld::Unseen);
        }
        let shortest = self.shortest(now).unwrap_or(round_trip);
        if shortest > Self::OLDEST {
            return Err(TooOld::SlowLink(shortest));
        }
        let picture = now.saturating_duration_since(state.at);
        if picture > (shortest + Self::SLACK).min(Self::OLDEST) {
            return Err(TooOld::Picture(picture));
        }
        let waited = round_trip.saturating_sub(shortest);
        if waited > Self::SLACK {
            return Err(TooOld::Late(waited));
        }
        Ok(waited)
    }

    /// Takes the round trip of a confirmation.
    fn measure(&mut self, now: Instant, seen: Seen) -> Result<(SentState, Duration), TooOld> {
        let state = self.sent.iter().find(|it| it.seq == seen.seq).copied();
        let state = state.ok_or(TooOld::Unseen)?;
        let elapsed = now.saturating_duration_since(state.at);
        let held = Duration::from_millis(seen.held_ms);
        // The page rounds to milliseconds.
        let rounded = Duration::from_millis(1);
        if held > elapsed.mul_f64(Self::SLEW) + rounded {
            return Err(TooOld::Unseen);
        }
        let round_trip = elapsed.saturating_sub(held);
        let is_first = self.arrived.is_none_or(|arrived| seen.seq > arrived);
        self.handle_received(now, seen.seq);
        // What it has shown for longer than it exists is no sample: it would make the shortest round
        // trip 0.
        if held > elapsed + rounded {
            return Ok((state, round_trip));
        }
        self.remember(now, round_trip);
        if is_first {
            self.adapt(now, round_trip);
        }
        Ok((state, round_trip))
    }

    fn remember(&mut self, now: Instant, round_trip: Duration) {
        self.samples.push_back(Sample {
            at: now,
            round_trip,
        });
        if self.samples.len() > Self::MOST_SAMPLES {
            self.samples.pop_front();
        }
    }

    /// Sends more states at once while that does not delay them, and fewer when it does: one at a time
    /// and, if that is no single loss, with pauses in which the link is idle.
    fn adapt(&mut self, now: Instant, round_trip: Duration) {
        let idle = self.idle_round_trip(now, round_trip);
        let delay = round_trip - idle;
        if delay > Self::DELAYED {
            self.window = 1;
            self.hold_until = Some(now + Self::CAUTION);
            self.late += 1;
            if self.late >= Self::QUEUED {
                self.pause = (delay * Self::PAUSE).min(Self::LONGEST_PAUSE);
            }
            return;
        }
        self.late = 0;
        self.pause = Duration::ZERO;
        if delay <= Self::PROMPT && self.hold_until.is_none_or(|until| now >= until) {
            // States that would follow each other faster than they are made need no window.
            let periods = idle.as_millis() / Self::PERIOD.as_millis();
            let periods = usize::try_from(periods).unwrap_or(Self::MOST_UNDER_WAY);
            let useful = if periods == 0 {
                1
            } else {
                1 + periods + Self::CONFIRMING
            };
            self.window = (self.window + 1).min(useful).min(Self::MOST_UNDER_WAY);
        }
    }

    /// The round trip of the idle link, after one that has just been measured.
    fn idle_round_trip(&mut self, now: Instant, round_trip: Duration) -> Duration {
        let known = self.idle.map_or(round_trip, |it| {
            let elapsed = now.saturating_duration_since(it.at);
            it.round_trip + elapsed.min(Self::SILENCE) / Self::FOLLOWS
        });
        let round_trip = known.min(round_trip);
        self.idle = Some(Sample {
            at: now,
            round_trip,
        });
        round_trip
    }

    fn recent(&self, now: Instant) -> impl Iterator<Item = Duration> {
        let is_recent = move |it: &&Sample| now.saturating_duration_since(it.at) < Self::MEMORY;
        let recent = self.samples.iter().filter(is_recent);
        recent.map(|it| it.round_trip)
    }

    fn shortest(&self, now: Instant) -> Option<Duration> {
        self.recent(now).min()
    }

    /// What is known of the link now.
    #[must_use]
    pub fn quality(&self, now: Instant) -> PageLinkQuality {
        let mut recent: Vec<Duration> = self.recent(now).collect();
        recent.sort_unstable();
        let milliseconds = |it: &Duration| u64::try_from(it.as_millis()).unwrap_or(u64::MAX);
        let late = recent.first().map(|&shortest| {
            let late = recent.iter().filter(|it| **it > shortest + Self::DELAYED);
            u8::try_from(late.count() * 100 / recent.len()).unwrap_or(100)
        });
        PageLinkQuality {
            round_trip_ms: recent.get(recent.len() / 2).map(milliseconds),
            loss_percent: late,
            way_back: self
                .heard
                .is_some_and(|at| now.saturating_duration_since(at) < Self::SILENCE),
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const ROVER: Option<u16> = Some(101);

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn seen(seq: u64, held_ms: u64) -> Seen {
        Seen { seq, held_ms }
    }

    /// A link that carries a state every 100 ms for 2 s, with this round trip. Returns the time of the
    /// last confirmation, and the number of the state.
    fn link(round_trip: u64) -> (PageLink, Instant, u64) {
        let (mut link, start) = (PageLink::default(), Instant::now());
        for seq in 0..20 {
            let sent = start + ms(100 * seq);
            link.handle_sent(sent, seq, ROVER);
            link.handle_seen(sent + ms(round_trip), seen(seq, 0))
                .unwrap();
        }
        (link, start + ms(1900 + round_trip), 19)
    }

    #[test]
    fn a_setpoint_by_a_fresh_picture_drives() {
        for round_trip in [0, 5, 600] {
            let (mut link, now, seq) = link(round_trip);
            let waited = link.handle_setpoint(now + ms(100), seen(seq, 100), ROVER);
            assert_eq!(waited, Ok(Duration::ZERO), "{round_trip}");
        }
    }

    #[test]
    fn no_state_is_left_out_on_a_long_link_whose_confirmations_go_with_setpoints() {
        let (mut link, start) = (PageLink::default(), Instant::now());
        let mut left_out = 0;
        for period in 0..300 {
            let now = start + ms(100 * period);
            // A state is confirmed by the next setpoint, at most 100 ms and a frame later.
            if let Some(seq) = period.checked_sub(8) {
                let confirmed = start + ms(100 * seq + 720);
                let _ = link.handle_seen(confirmed, seen(seq, 120));
            }
            match link.may_send(now) {
                true => link.handle_sent(now, period, ROVER),
                // The window grows in the beginning.
                false => left_out += u32::from(period > 100),
            }
        }
        assert_eq!(left_out, 0);
    }

    #[test]
    fn a_setpoint_that_was_held_up_for_more_than_300_ms_is_refused() {
        let (mut link, now, seq) = link(20);
        let waited = link.handle_setpoint(now + ms(200), seen(seq, 0), ROVER);
        assert_eq!(waited, Ok(ms(200)));
        let refused = link.handle_setpoint(now + ms(320), seen(seq, 19), ROVER);
        assert!(
            matches!(refused, Err(TooOld::Picture(_) | TooOld::Late(_))),
            "{refused:?}"
        );
    }

    #[test]
    fn a_picture_that_is_older_than_the_round_trip_and_300_ms_is_not_driven_by() {
        let (mut link, now, seq) = link(100);
        let fresh = link.handle_setpoint(now + ms(300), seen(seq, 300), ROVER);
        assert_eq!(fresh, Ok(Duration::ZERO));
        let old = link.handle_setpoint(now + ms(301), seen(seq, 301), ROVER);
        assert_eq!(old, Err(TooOld::Picture(ms(401))));
    }

    #[test]
    fn a_picture_is_never_older_than_a_second() {
        let (mut link, now, seq) = link(900);
        assert!(
            link.handle_setpoint(now + ms(100), seen(seq, 100), ROVER)
                .is_ok()
        );
        let old = link.handle_setpoint(now + ms(101), seen(seq, 101), ROVER);
        assert_eq!(old, Err(TooOld::Picture(ms(1001))));
    }

    #[test]
    fn a_link_that_takes_more_than_a_second_there_and_back_is_not_driven_over() {
        for round_trip in [1600, 3000] {
            let (mut link, now, seq) = link(round_trip);
            let refused = link.handle_setpoint(now, seen(seq, 0), ROVER);
            assert_eq!(refused, Err(TooOld::SlowLink(ms(round_trip))));
        }
    }

    #[test]
    fn a_link_that_becomes_slow_is_refused_at_once_and_named_slow_after_10_s() {
        let (mut link, start, _) = link(20);
        let mut last = None;
        for step in 0..120 {
            let sent = start + ms(100 * step);
            link.handle_sent(sent, 100 + step, ROVER);
            let now = sent + ms(1600);
            let refused = link.handle_setpoint(now, seen(100 + step, 0), ROVER);
            assert!(refused.is_err(), "{step}");
            last = refused.err();
        }
        assert_eq!(last, Some(TooOld::SlowLink(ms(1600))));
    }

    #[test]
    fn no_page_drives_by_a_state_that_it_was_not_sent_or_of_another_vehicle() {
        let (mut link, now, seq) = link(20);
        for (state, vehicle) in [
            (seen(seq + 1, 0), ROVER),
            (seen(u64::MAX, 0), ROVER),
            (seen(seq, 0), Some(102)),
            (seen(seq, 0), None),
        ] {
            let refused = link.handle_setpoint(now, state, vehicle);
            assert_eq!(refused, Err(TooOld::Unseen), "{state:?} {vehicle:?}");
        }
        // A state that was replaced on the screen is not the one that the operator sees.
        let before = link.handle_setpoint(now, seen(seq - 1, 0), ROVER);
        assert_eq!(before, Err(TooOld::Unseen));
    }

    #[test]
    fn a_page_that_claims_to_have_shown_a_state_for_too_long_makes_no_round_trip() {
        let (mut link, now, seq) = link(200);
        for held in [240, 100_000, u64::MAX] {
            let refused = link.handle_setpoint(now, seen(seq, held), ROVER);
            assert_eq!(refused, Err(TooOld::Unseen), "{held}");
        }
        link.handle_setpoint(now, seen(seq, 202), ROVER).unwrap();
        let quality = link.quality(now);
        assert_eq!(
            (quality.round_trip_ms, quality.loss_percent),
            (Some(200), Some(0))
        );
    }

    #[test]
    fn a_page_whose_clock_is_slewed_drives_over_a_short_link() {
        let (mut link, now, seq) = link(4);
        for held in [100, 200, 300] {
            // The page's clock gains 8 % while the station's loses 8 %.
            let shown = held * 108 / 92;
            let waited = link.handle_setpoint(now + ms(held), seen(seq, shown), ROVER);
            assert_eq!(waited, Ok(Duration::ZERO), "{held}");
        }
        assert_eq!(link.quality(now + ms(300)).round_trip_ms, Some(4));
    }

    #[test]
    fn one_state_is_under_way_until_the_page_confirms_it() {
        let (mut link, now) = (PageLink::default(), Instant::now());
        assert!(link.may_send(now));
        link.handle_sent(now, 1, ROVER);
        assert!(!link.may_send(now));
        link.handle_received(now, 7);
        assert!(!link.may_send(now), "another one");
        link.handle_received(now + ms(300), 1);
        assert!(
            link.may_send(now + ms(300)),
            "it has arrived, though nobody sees it"
        );
    }

    /// States are sent every 100 ms if the link takes them. Returns the most under way in the last
    /// second of 10.
    fn most_under_way(arrival: impl Fn(u64, u64) -> u64) -> usize {
        let (mut link, start) = (PageLink::default(), Instant::now());
        let (mut busy_until, mut arriving, mut most) = (0, VecDeque::new(), 0);
        for time in 0..10_000 {
            while let Some((seq, _)) = arriving.pop_front_if(|(_, at)| *at == time) {
                link.handle_seen(start + ms(time), seen(seq, 0)).unwrap();
            }
            if time % 100 == 0 && link.may_send(start + ms(time)) {
                link.handle_sent(start + ms(time), time, ROVER);
                busy_until = arrival(time, busy_until);
                arriving.push_back((time, busy_until));
            }
            if time >= 9_000 {
                most = most.max(link.under_way());
            }
        }
        most
    }

    #[test]
    fn a_long_link_carries_ten_states_a_second() {
        let most = most_under_way(|time, _| time + 600);
        assert!((6..=7).contains(&most), "{most}");
    }

    #[test]
    fn a_slow_link_is_not_filled_with_states() {
        // Every state takes 400 ms of the link.
        let most = most_under_way(|time, busy_until| time.max(busy_until) + 400);
        assert!(most <= 2, "{most}");
    }

    /// How many states are sent in each second, of a link that takes `slow` ms for each from the fifth
    /// to the fifteenth second.
    fn sent_in_each_second(slow: u64) -> Vec<u32> {
        let (mut link, start) = (PageLink::default(), Instant::now());
        let (mut busy_until, mut arriving, mut sent) = (0, VecDeque::new(), vec![0; 20]);
        for time in 0..20_000 {
            while let Some((seq, _)) = arriving.pop_front_if(|(_, at)| *at == time) {
                link.handle_seen(start + ms(time), seen(seq, 0)).unwrap();
            }
            let now = start + ms(time);
            if time % 100 == 0 && link.may_send(now) {
                link.handle_sent(now, time, ROVER);
                sent[usize::try_from(time / 1000).unwrap()] += 1;
                let takes = if (5_000..15_000).contains(&time) {
                    slow
                } else {
                    5
                };
                busy_until = busy_until.max(time) + takes;
                arriving.push_back((time, busy_until));
            }
        }
        sent
    }

    #[test]
    fn a_link_that_begins_to_queue_carries_a_state_a_second_until_it_is_free_again() {
        let sent = sent_in_each_second(400);
        assert_eq!(sent[3..5], [10, 10]);
        assert!(sent[6..15].iter().all(|it| *it <= 1), "{sent:?}");
        assert_eq!(sent[17..20], [10, 10, 10], "{sent:?}");
    }

    #[test]
    fn a_single_loss_makes_no_pause() {
        let (mut link, now, seq) = link(20);
        link.handle_sent(now, seq + 1, ROVER);
        let heard = now + ms(250);
        link.handle_seen(heard, seen(seq + 1, 0)).unwrap();
        assert!(link.may_send(heard));
        link.handle_sent(heard, seq + 2, ROVER);
        let heard = heard + ms(250);
        link.handle_seen(heard, seen(seq + 2, 0)).unwrap();
        assert!(!link.may_send(heard));
    }

    #[test]
    fn the_way_back_works_while_confirmations_arrive() {
        let (link, now, _) = link(20);
        assert!(link.quality(now + ms(999)).way_back);
        assert!(!link.quality(now + ms(1000)).way_back);
        assert!(!PageLink::default().quality(now).way_back);
    }

    #[test]
    fn losses_are_the_round_trips_that_took_a_retransmission() {
        let (mut link, now, seq) = link(20);
        for n in 1..=20 {
            let sent = now + ms(300 * n);
            link.handle_sent(sent, seq + n, ROVER);
            let delay = if n % 2 == 0 { 250 } else { 20 };
            link.handle_seen(sent + ms(delay), seen(seq + n, 0))
                .unwrap();
        }
        let quality = link.quality(now + ms(6300));
        assert_eq!(
            (quality.round_trip_ms, quality.loss_percent),
            (Some(20), Some(25))
        );
    }
}
