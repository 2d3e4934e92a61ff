//! One subscription on its own: its times, and what it takes for its own.

use super::*;
use crate::codec::Message;
use crate::messages::core::{QueryControl, QueryStatus, ReportControl, ReportStatus};

const US: JausId = JausId::new(42, 1, 1);
const PEER: JausId = JausId::new(101, 1, 33);
const SECOND: Duration = Duration::from_secs(1);
/// The number that the peer gives to the event.
const EVENT: u8 = 7;
/// The number of the request.
const REQUEST: u8 = 5;

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

fn topic(when: When) -> Topic {
    Topic {
        peer: PEER,
        query: QueryStatus.encode().unwrap(),
        report: ReportStatus::CODE,
        when,
    }
}

fn event(event_id: u8, sequence_number: u8) -> Event {
    Event {
        event_id,
        sequence_number,
        report_message: ReportStatus::default().encode().unwrap(),
    }
}

struct Rig {
    it: Subscription,
    out: Outbox,
    now: Instant,
    news: Vec<SubscriptionNews>,
}

impl Rig {
    /// A subscription that was requested just now.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new(when: When) -> Self {
        let (now, mut out) = (Instant::now(), Outbox::new(US));
        let topic = topic(when);
        let order = Order {
            peer: PEER,
            report: topic.report,
            when,
            patience: Patience::default(),
            create: topic.create_event(REQUEST).unwrap().encode().unwrap(),
            request: REQUEST,
            query: topic.query,
        };
        Self {
            it: Subscription::new(now, order, &mut out),
            out,
            now,
            news: Vec::new(),
        }
    }

    /// A subscription that was confirmed just now.
    fn up(when: When) -> Self {
        let mut rig = Self::new(when);
        let hz = match when {
            When::Periodic { hz, .. } => hz,
            When::OnChange => 0.0,
        };
        rig.confirm(hz);
        assert!(matches!(rig.news[..], [SubscriptionNews::Up { .. }]));
        rig.news.clear();
        rig
    }

    fn confirm(&mut self, hz: f64) {
        let mut confirm = ConfirmEventRequest {
            request_id: REQUEST,
            event_id: EVENT,
            ..ConfirmEventRequest::default()
        };
        confirm.set_confirmed_periodic_rate_hz(hz).unwrap();
        self.it.handle_confirm(self.now, &confirm, &mut self.news);
    }

    fn hear(&mut self, event: Event) {
        self.it.handle_event(self.now, event, &mut self.news);
    }

    fn lose(&mut self) {
        self.it.handle_lost_peer(self.now, &mut self.news);
    }

    fn reject(&mut self) {
        let reason = Rejection {
            code: Some(3),
            text: None,
        };
        self.it.handle_reject(self.now, reason, &mut self.news);
    }

    /// Advances to the next timeout and handles it; returns how long that took.
    fn next(&mut self) -> Duration {
        let due = self.it.poll_timeout().unwrap();
        let pause = due - self.now;
        self.now = due;
        self.it.handle_timeout(due, &mut self.news, &mut self.out);
        pause
    }

    /// The time until the next timeout.
    fn pause(&self) -> Option<Duration> {
        self.it.poll_timeout().map(|due| due - self.now)
    }

    /// How many messages of a type were sent since the last call.
    fn sent(&mut self) -> (usize, usize) {
        let all: Vec<_> = std::iter::from_fn(|| self.out.pop()).collect();
        let creates = all.iter().filter(|it| it.payload == self.it.create);
        let creates = creates.count();
        (creates, all.len() - creates)
    }
}

#[test]
fn an_event_is_its_own_by_number_and_report_and_expected_by_its_report_alone() {
    let mut rig = Rig::new(When::OnChange);
    let control = Event {
        report_message: ReportControl::default().encode().unwrap(),
        ..event(EVENT, 0)
    };
    assert!(rig.it.expects(&event(9, 0)) && !rig.it.expects(&control));
    assert!(
        !rig.it.owns(&event(EVENT, 0)),
        "its number is not known yet"
    );
    rig.confirm(0.0);
    assert!(rig.it.owns(&event(EVENT, 0)) && !rig.it.owns(&event(9, 0)));
    assert!(!rig.it.owns(&control) && !rig.it.expects(&event(9, 0)));
}

#[test]
fn a_peer_takes_topics_of_one_type_and_query_for_the_same() {
    let other_query = QueryControl.encode().unwrap();
    for (when, topic, expected) in [
        (When::OnChange, topic(When::OnChange), true),
        (When::hz(1.0), topic(When::hz(2.0)), true),
        (When::hz(1.0), topic(When::OnChange), false),
        (When::OnChange, topic(When::hz(1.0)), false),
        (
            When::OnChange,
            Topic {
                peer: US,
                ..topic(When::OnChange)
            },
            false,
        ),
        (
            When::OnChange,
            Topic {
                query: other_query,
                ..topic(When::OnChange)
            },
            false,
        ),
    ] {
        assert_eq!(Rig::new(when).it.equals(&topic), expected, "{topic:?}");
    }
}

#[test]
fn an_event_of_the_same_query_with_the_same_number_displaces_another() {
    let it = Rig::up(When::OnChange).it;
    type Change = fn(&mut Subscription);
    let changes: [(Change, bool); 4] = [
        (|_| {}, true),
        (|it| it.peer = US, false),
        (|it| it.query = QueryControl.encode().unwrap(), false),
        (|it| it.event = Some(9), false),
    ];
    for (change, expected) in changes {
        let mut other = Rig::up(When::hz(1.0)).it;
        change(&mut other);
        assert_eq!(it.is_displaced_by(&other), expected);
    }
    let (new, mut other) = (Rig::new(When::OnChange).it, Rig::new(When::hz(1.0)).it);
    other.event = None;
    assert!(!new.is_displaced_by(&other), "neither has a number");
}

#[test]
fn news_of_a_confirmation_are_the_first_one_and_another_rate() {
    let mut rig = Rig::new(When::hz(10.0));
    for (hz, news) in [(10.0, 1), (10.0, 1), (5.0, 2), (5.0, 2)] {
        rig.confirm(hz);
        assert_eq!(rig.news.len(), news, "{hz} Hz");
    }
    let mut rig = Rig::new(When::hz(10.0));
    rig.confirm(0.0);
    let Some(SubscriptionNews::Up { hz: Some(hz) }) = rig.news.pop() else {
        panic!("it is up");
    };
    assert_eq!(hz, 10.0, "a peer that confirms no rate");
}

#[test]
fn a_report_that_came_early_is_delivered_if_it_has_the_confirmed_number() {
    for (number, reports) in [(EVENT, 1), (9, 0)] {
        let mut rig = Rig::new(When::OnChange);
        rig.it.keep(event(number, 3));
        rig.confirm(0.0);
        assert_eq!(rig.news.len(), 1 + reports);
    }
}

#[test]
fn a_rate_is_too_slow_if_it_is_a_step_below_the_least() {
    const STEP: f64 = 1092.0 / 65535.0;
    for (steps, is_too_slow) in [(0.0, false), (0.5, false), (2.0, true)] {
        let mut rig = Rig::new(When::hz(50.0).at_least(20.0));
        rig.confirm(20.0 - steps * STEP);
        let is_over = matches!(rig.news[..], [SubscriptionNews::Ended(_)]);
        assert_eq!(is_over, is_too_slow, "{steps} steps");
    }
    let mut rig = Rig::new(When::hz(50.0).at_least(20.0));
    (rig.it.hz, rig.it.state) = (Some(20.0 - STEP), State::Up);
    assert_eq!(rig.it.too_slow(), None);
}

#[test]
fn renewals_come_three_times_in_a_lifetime_and_on_change_every_20_seconds() {
    let (periodic, change) = (When::hz(1.0), When::OnChange);
    for (when, minutes, expected) in [
        (periodic, None, None),
        (periodic, Some(0), None),
        (periodic, Some(3), Some(60)),
        (change, None, Some(20)),
        (change, Some(0), Some(20)),
        (change, Some(3), Some(20)),
    ] {
        let mut rig = Rig::new(when);
        rig.it.lifetime = minutes.map(|minutes| minutes * 60 * SECOND);
        let refresh = rig.it.refresh();
        assert_eq!(
            refresh,
            expected.map(|it| it * SECOND),
            "{when:?} {minutes:?}"
        );
    }
    let mut short = Rig::new(change);
    short.it.lifetime = Some(30 * SECOND);
    assert_eq!(short.it.refresh(), Some(10 * SECOND));
}

#[test]
fn a_lifetime_counts_from_when_it_is_reported_unless_an_answer_is_due() {
    let mut rig = Rig::up(When::OnChange);
    rig.now += 5 * SECOND;
    rig.it.handle_lifetime(rig.now, 30 * SECOND);
    assert_eq!(rig.pause(), Some(10 * SECOND));
    for mut rig in [Rig::new(When::OnChange), Rig::up(When::OnChange)] {
        if rig.it.state == State::Up {
            rig.next();
        }
        let before = rig.pause();
        rig.it.handle_lifetime(rig.now, 30 * SECOND);
        assert_eq!(rig.pause(), before);
    }
    let mut rig = Rig::up(When::OnChange);
    rig.lose();
    rig.it.asked = 0;
    rig.it.handle_lifetime(rig.now, 30 * SECOND);
    assert_eq!(rig.pause(), Some(Duration::ZERO), "it is down");
}

#[test]
fn the_half_of_the_sequence_numbers_behind_the_last_is_old() {
    for (sequence, is_new) in [
        (10, false),
        (11, true),
        (137, true),
        (138, false),
        (9, false),
    ] {
        let mut rig = Rig::up(When::OnChange);
        rig.hear(event(EVENT, 10));
        rig.hear(event(EVENT, sequence));
        assert_eq!(rig.news.len(), 1 + usize::from(is_new), "{sequence}");
    }
}

#[test]
fn a_gap_is_lost_reports_as_far_as_the_rate_explains_it() {
    // 10 Hz for 2 s, a quarter more, and 16.
    for (when, ahead, expected) in [
        (When::hz(10.0), 1, 0),
        (When::hz(10.0), 2, 1),
        (When::hz(10.0), 41, 40),
        (When::hz(10.0), 42, 0),
        (When::OnChange, 42, 41),
    ] {
        let mut rig = Rig::up(when);
        rig.it.hz = rig.it.hz.map(|_| 10.0);
        rig.hear(event(EVENT, 0));
        rig.now += 2 * SECOND;
        assert_eq!(rig.it.lost(rig.now, ahead), expected, "{when:?} {ahead}");
        rig.hear(event(EVENT, ahead));
        let Some(SubscriptionNews::Report { lost, .. }) = rig.news.pop() else {
            panic!("a report");
        };
        assert_eq!(lost, expected);
    }
}

#[test]
fn silence_is_four_periods_and_half_a_second_and_at_first_two_seconds() {
    for (hz, after, expected) in [(1.0, 0, 4000), (1.0, 10_000, 4000), (100.0, 0, 2000)] {
        let mut rig = Rig::up(When::hz(hz));
        rig.it.hz = Some(hz);
        rig.now += ms(after);
        rig.hear(event(EVENT, 0));
        assert_eq!(rig.pause(), Some(ms(expected)), "{hz} Hz");
    }
    let mut rig = Rig::up(When::hz(100.0));
    rig.now += 5 * SECOND;
    rig.hear(event(EVENT, 0));
    assert_eq!(rig.pause(), Some(ms(500)));
    rig.sent();
    rig.next();
    let since = rig.now - ms(500);
    let why = Outage::Silent;
    assert_eq!(rig.news.pop(), Some(SubscriptionNews::Down { since, why }));
    assert_eq!(rig.sent(), (1, 1), "requested again at once");
}

#[test]
fn what_is_down_is_requested_ever_more_seldom() {
    let mut rig = Rig::up(When::OnChange);
    rig.lose();
    rig.sent();
    let pauses: Vec<_> = (0..7).map(|_| rig.next().as_millis()).collect();
    assert_eq!(pauses, [0, 500, 1000, 2000, 4000, 5000, 5000]);
    // A new subscription asked for the lifetime once, and a peer of version 1.0 does not answer.
    assert_eq!(rig.sent(), (7, 2));
    rig.hear(event(EVENT, 0));
    let [SubscriptionNews::Up { .. }, SubscriptionNews::Report { .. }] = rig.news[1..] else {
        panic!("only the network was down: {:?}", rig.news);
    };
    assert_eq!(rig.pause(), Some(Duration::ZERO), "and is renewed at once");
}

#[test]
fn a_new_subscription_is_requested_at_intervals_and_given_up() {
    let mut rig = Rig::new(When::OnChange);
    let pauses: Vec<_> = (0..3).map(|_| rig.next().as_millis()).collect();
    assert_eq!(pauses, [500, 500, 500]);
    assert_eq!(rig.sent(), (3, 3));
    let no_answer = NoAnswer {
        peer: PEER,
        tries: 3,
        waited: ms(1500),
    };
    let end = SubscriptionEnd::NoAnswer(no_answer);
    assert_eq!(rig.news, [SubscriptionNews::Ended(end)]);
}

#[test]
fn unconfirmed_renewals_end_events_on_change_but_not_periodic_ones_that_are_reported() {
    for (when, is_down) in [(When::OnChange, true), (When::hz(1.0), false)] {
        let mut rig = Rig::up(when);
        rig.it.handle_lifetime(rig.now, 30 * SECOND);
        for sequence in 0..30 {
            rig.now += SECOND;
            if !is_down {
                rig.hear(event(EVENT, sequence));
            }
            if rig.it.poll_timeout().is_some_and(|due| due <= rig.now) {
                rig.it.handle_timeout(rig.now, &mut rig.news, &mut rig.out);
            }
        }
        assert_eq!(rig.it.state == State::Down, is_down, "{when:?}");
    }
}

#[test]
fn a_refused_event_is_requested_again_after_five_seconds() {
    let mut rig = Rig::up(When::OnChange);
    rig.reject();
    let [SubscriptionNews::Down { .. }] = rig.news[..] else {
        panic!("it is down: {:?}", rig.news);
    };
    for _time in 0..2 {
        assert_eq!(rig.next(), 5 * SECOND);
        assert_eq!(rig.pause(), Some(ms(500)));
        rig.reject();
        assert_eq!((rig.pause(), rig.it.asked), (Some(5 * SECOND), 0));
    }
    rig.it.handle_found_peer(rig.now);
    assert_eq!(rig.pause(), Some(Duration::ZERO));
    let mut new = Rig::new(When::OnChange);
    new.reject();
    assert!(matches!(new.news[..], [SubscriptionNews::Ended(_)]));
}

#[test]
fn a_sign_of_life_after_a_second_of_silence_hastens_the_next_request() {
    for (silence, expected) in [(999, 4001), (1000, 0)] {
        let mut rig = Rig::up(When::OnChange);
        rig.reject();
        rig.it.handle_sign_of_life(rig.now);
        rig.now += ms(silence);
        rig.it.handle_sign_of_life(rig.now);
        assert_eq!(rig.pause(), Some(ms(expected)), "after {silence} ms");
    }
    let mut rig = Rig::up(When::OnChange);
    rig.now += 2 * SECOND;
    rig.it.handle_sign_of_life(rig.now);
    assert_eq!(rig.pause(), Some(18 * SECOND), "it is not down");
    rig.it.handle_found_peer(rig.now);
    assert_eq!(rig.pause(), Some(18 * SECOND));
}

#[test]
fn a_doubted_event_is_requested_after_the_interval_since_the_last_request() {
    for (after, expected) in [(200, 300), (500, 0), (700, 0)] {
        let mut rig = Rig::up(When::OnChange);
        rig.now += ms(after);
        rig.it.doubt(rig.now);
        assert_eq!((rig.it.event, rig.pause()), (None, Some(ms(expected))));
        // The same for a confirmation that was not requested.
        let mut rig = Rig::up(When::OnChange);
        rig.now += ms(after);
        rig.confirm(0.0);
        assert_eq!(rig.pause(), Some(ms(expected)), "after {after} ms");
    }
}

#[test]
fn only_the_report_that_a_renewal_repeats_is_no_change() {
    let mut rig = Rig::up(When::OnChange);
    for (renews, sequence, news) in [(false, 0, 1), (false, 1, 2), (true, 2, 2), (false, 3, 3)] {
        if renews {
            rig.confirm(0.0);
        }
        rig.hear(event(EVENT, sequence));
        assert_eq!(rig.news.len(), news, "number {sequence}");
    }
}
