//! The client side of control: requests, renewals, loss and release.

use std::time::Duration;

use super::{Bench, CLIENT, OTHER, PEER};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{
    ConfirmControl, QueryControl, QueryIncarnation, QueryStatus, QueryTimeout, RejectControl,
    ReleaseControl, ReportControl, ReportIncarnation, ReportStatus, ReportTimeout, RequestControl,
};
use crate::service::{
    ControlId, ControlLost, ControlNews, ControlRefused, Event, Patience, code_of,
};

fn confirm(code: u8) -> ConfirmControl {
    ConfirmControl {
        response_code: code.into(),
    }
}

fn reject(code: u8) -> RejectControl {
    RejectControl {
        response_code: code.into(),
    }
}

fn request(bench: &mut Bench) -> ControlId {
    let asked = bench
        .stack
        .request_control(bench.now, PEER, 127, Patience::default());
    bench.collect();
    asked.expect("nothing is in the way")
}

/// A bench that holds control of a peer with a lifetime of `seconds`.
fn held(seconds: u8) -> (Bench, ControlId) {
    let mut bench = Bench::new();
    let id = request(&mut bench);
    bench.hear(PEER, &confirm(0));
    let timeout = seconds.into();
    bench.hear(PEER, &ReportTimeout { timeout });
    assert_eq!(news(&mut bench), [ControlNews::Granted]);
    bench.sent.clear();
    (bench, id)
}

fn news(bench: &mut Bench) -> Vec<ControlNews> {
    let events = bench.events().into_iter();
    events
        .filter_map(|event| match event {
            Event::Control(_, news) => Some(news),
            _ => None,
        })
        .collect()
}

/// Confirms renewals for a while; returns how many there were.
fn renew_for(bench: &mut Bench, duration: Duration) -> usize {
    let end = bench.now + duration;
    let mut renewals = 0;
    while bench.now < end {
        bench.run_ms(10);
        for _ in bench.sent::<RequestControl>() {
            renewals += 1;
            bench.hear(PEER, &confirm(0));
        }
    }
    renewals
}

#[test]
fn control_is_asked_for_with_the_authority_and_again_if_nobody_answers() {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.run_ms(600);
    let asked = bench.sent::<RequestControl>();
    assert!(asked.len() == 2 && asked.iter().all(|it| it.authority_code == 127));
    bench.hear(PEER, &confirm(0));
    assert_eq!(news(&mut bench), [ControlNews::Granted]);
}

#[test]
fn who_says_nothing_is_given_up() {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.run_ms(1500);
    let [ControlNews::Refused(ControlRefused::NoAnswer(failure))] = news(&mut bench)[..] else {
        panic!("it is to be given up");
    };
    assert_eq!(failure.tries, 3);
    assert_eq!(failure.waited, Duration::from_millis(1500));
    bench.run_ms(60_000);
    bench.sent.clear();
    request(&mut bench);
    assert_eq!(
        bench.sent::<RequestControl>().len(),
        1,
        "it can be tried again"
    );
}

#[test]
fn a_refusal_says_why() {
    let whys = [
        (1, ControlRefused::NotAvailable),
        (2, ControlRefused::InsufficientAuthority(127)),
        (9, ControlRefused::Code(9)),
    ];
    for (code, why) in whys {
        let mut bench = Bench::new();
        request(&mut bench);
        bench.hear(PEER, &confirm(code));
        assert_eq!(news(&mut bench), [ControlNews::Refused(why)]);
    }
}

#[test]
fn an_answer_of_somebody_else_is_none() {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.hear(OTHER, &confirm(0));
    assert_eq!(news(&mut bench), []);
}

#[test]
fn control_is_renewed_at_least_four_times_in_its_lifetime() {
    for (seconds, renewals) in [(1, 240..=300), (5, 48..=60), (0, 48..=60), (255, 48..=60)] {
        let (mut bench, _) = held(seconds);
        let renewed = renew_for(&mut bench, Duration::from_secs(60));
        assert!(
            renewals.contains(&renewed),
            "{seconds} s: {renewed} renewals"
        );
        assert_eq!(news(&mut bench), []);
    }
}

#[test]
fn confirmations_that_get_lost_in_a_row_do_not_cost_control() {
    let (mut bench, _) = held(4);
    renew_for(&mut bench, Duration::from_secs(2));
    let end = bench.now + Duration::from_secs(5);
    let mut renewals = 0;
    while bench.now < end {
        bench.run_ms(10);
        for _ in bench.sent::<RequestControl>() {
            renewals += 1;
            // Every fifth renewal is confirmed.
            if renewals % 5 == 0 {
                bench.hear(PEER, &confirm(0));
            }
        }
    }
    assert_eq!(news(&mut bench), []);
}

#[test]
fn a_peer_that_does_not_say_how_long_control_lasts_is_not_asked_for_ever() {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.hear(PEER, &confirm(0));
    let mut questions = 0;
    for _ in 0..1000 {
        bench.run_ms(10);
        let sent = bench.sent.clone();
        questions += bench.sent::<QueryTimeout>().len();
        bench.sent = sent;
        for _ in bench.sent::<RequestControl>() {
            bench.hear(PEER, &confirm(0));
        }
    }
    assert_eq!(questions, 4);
    assert_eq!(news(&mut bench), [ControlNews::Granted]);
}

#[test]
fn a_silent_peer_has_taken_control_along_before_its_own_time_is_up() {
    let (mut bench, _) = held(2);
    renew_for(&mut bench, Duration::from_secs(10));
    let last_heard = bench.now;
    bench.run_ms(2100);
    let [ControlNews::Lost(ControlLost::Silent(since))] = news(&mut bench)[..] else {
        panic!("it is lost");
    };
    assert_eq!(since, Duration::from_secs(2));
    assert!(bench.now - last_heard < Duration::from_millis(2200));
    bench.sent.clear();
    bench.run_ms(60_000);
    assert_eq!(bench.sent::<RequestControl>(), [], "nobody asks by itself");
}

#[test]
fn control_lasts_over_a_way_on_which_every_repetition_is_confirmed_late() {
    const ROUND_TRIP: Duration = Duration::from_millis(1600);
    let (mut bench, _) = held(4);
    let mut under_way = std::collections::VecDeque::new();
    let end = bench.now + Duration::from_secs(60);
    while bench.now < end {
        bench.run_ms(10);
        under_way.extend(bench.sent::<RequestControl>().iter().map(|_| bench.now));
        while under_way
            .front()
            .is_some_and(|&at| at + ROUND_TRIP <= bench.now)
        {
            under_way.pop_front();
            bench.hear(PEER, &confirm(0));
        }
        assert_eq!(news(&mut bench), []);
    }
}

#[test]
fn control_that_is_taken_is_lost_and_not_asked_for_again() {
    let (mut bench, _) = held(5);
    bench.hear(PEER, &reject(0));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::TakenBack)]
    );
    bench.run_ms(60_000);
    assert_eq!(bench.sent::<RequestControl>(), []);
}

#[test]
fn an_emergency_takes_control() {
    let (mut bench, _) = held(5);
    bench.hear(PEER, &reject(1));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::NotAvailable)]
    );
}

/// Denies renewals for a while, and reports `controller` to queries.
fn deny_for(bench: &mut Bench, duration: Duration, controller: JausId) {
    let end = bench.now + duration;
    while bench.now < end {
        bench.run_ms(10);
        for _ in bench.sent::<RequestControl>() {
            bench.hear(PEER, &confirm(1));
        }
        for _ in bench.sent::<QueryControl>() {
            bench.hear(PEER, &controlled_by(controller));
        }
    }
}

fn controlled_by(controller: JausId) -> ReportControl {
    ReportControl {
        subsystem_id: controller.subsystem(),
        node_id: controller.node(),
        component_id: controller.component(),
        ..ReportControl::default()
    }
}

#[test]
fn control_that_cannot_be_renewed_ends_with_its_lifetime() {
    let (mut bench, _) = held(5);
    deny_for(&mut bench, Duration::from_millis(4900), CLIENT);
    assert_eq!(news(&mut bench), []);
    deny_for(&mut bench, Duration::from_millis(200), CLIENT);
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::NotAvailable)]
    );
}

#[test]
fn control_that_lasts_for_ever_outlasts_an_emergency() {
    let (mut bench, _) = held(0);
    deny_for(&mut bench, Duration::from_secs(60), CLIENT);
    renew_for(&mut bench, Duration::from_secs(60));
    assert_eq!(news(&mut bench), []);
}

#[test]
fn control_that_is_refused_and_not_ours_any_more_is_lost() {
    let (mut bench, _) = held(0);
    deny_for(&mut bench, Duration::from_secs(2), OTHER);
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::NotAvailable)]
    );
}

#[test]
fn a_lost_reject_is_noticed_with_the_next_renewal() {
    let (mut bench, _) = held(5);
    bench.run_ms(300);
    assert_eq!(bench.sent::<RequestControl>().len(), 1);
    bench.hear(PEER, &confirm(2));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::Outranked)]
    );
}

#[test]
fn control_that_comes_back_behind_the_applications_back_is_released() {
    let (mut bench, _) = held(5);
    bench.hear(PEER, &reject(0));
    bench.sent.clear();
    bench.hear(PEER, &confirm(0));
    assert_eq!(bench.sent::<ReleaseControl>().len(), 1);
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::TakenBack)]
    );
}

#[test]
fn a_rejection_that_came_after_a_later_confirmation_leaves_no_control_behind() {
    let (mut bench, _) = held(0);
    bench.hear(PEER, &reject(0));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::TakenBack)]
    );
    assert_eq!(bench.sent::<ReleaseControl>().len(), 1);
    bench.run_ms(60_000);
    assert_eq!(bench.sent::<ReleaseControl>(), [], "once");
}

#[test]
fn a_release_is_repeated_until_it_is_confirmed() {
    let (mut bench, id) = held(5);
    bench.stack.release_control(bench.now, id);
    bench.stack.release_control(bench.now, id);
    bench.run_ms(600);
    assert_eq!(bench.sent::<ReleaseControl>().len(), 2);
    bench.hear(PEER, &reject(0));
    assert_eq!(news(&mut bench), [ControlNews::Released]);
    bench.run_ms(60_000);
    assert_eq!(bench.sent, [], "{CLIENT} has nothing more to say");
}

#[test]
fn a_release_is_repeated_for_as_long_as_control_can_last() {
    let (mut bench, id) = held(5);
    bench.stack.release_control(bench.now, id);
    bench.run_ms(60_000);
    assert_eq!(
        bench.sent::<ReleaseControl>().len(),
        10,
        "every 0.5 s for 5 s"
    );
    assert_eq!(news(&mut bench), [ControlNews::Released]);
}

#[test]
fn a_peer_is_controlled_once_at_a_time() {
    let (mut bench, id) = held(5);
    let again = |bench: &mut Bench| {
        bench
            .stack
            .request_control(bench.now, PEER, 9, Patience::default())
    };
    assert_eq!(again(&mut bench), Err(ControlRefused::Already));
    bench.stack.release_control(bench.now, id);
    assert!(again(&mut bench).is_ok());
    bench.hear(PEER, &reject(0));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Released],
        "the end of the control before, without which its release would wait for ever"
    );
    bench.hear(PEER, &confirm(0));
    assert_eq!(news(&mut bench), [ControlNews::Granted]);
}

fn status(code: u8) -> ReportStatus {
    ReportStatus {
        status: code.into(),
        reserved: 0,
    }
}

#[test]
fn a_peer_under_control_is_asked_for_its_status_and_every_change_is_news() {
    let (mut bench, _) = held(5);
    bench.run_ms(900);
    assert_eq!(
        bench.sent::<QueryStatus>().len(),
        5,
        "at once, then every 0.2 s"
    );
    for code in [2, 2, 1, 5] {
        bench.hear(PEER, &status(code));
    }
    let expected = [2, 1, 5].map(ControlNews::Status);
    assert_eq!(news(&mut bench), expected);
}

#[test]
fn a_peer_that_reports_no_status_is_asked_for_it_less_often_but_for_ever() {
    let (mut bench, _) = held(5);
    let mut asked = Vec::new();
    for _ in 0..4 {
        let end = bench.now + Duration::from_secs(2);
        let mut queries = 0;
        while bench.now < end {
            bench.run_ms(10);
            for sent in std::mem::take(&mut bench.sent) {
                match code_of(&sent.1) {
                    Some(QueryStatus::CODE) => queries += 1,
                    Some(RequestControl::CODE) => bench.hear(PEER, &confirm(0)),
                    _ => {}
                }
            }
        }
        asked.push(queries);
    }
    assert_eq!(asked, [11, 2, 2, 2]);
    bench.hear(PEER, &status(2));
    assert_eq!(news(&mut bench), [ControlNews::Status(2)]);
}

#[test]
fn what_a_peer_grants_after_its_request_was_given_up_is_released() {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.run_ms(1500);
    assert_eq!(
        bench.sent::<ReleaseControl>().len(),
        1,
        "it may have granted it"
    );
    bench.run_ms(2000);
    assert_eq!(bench.sent::<ReleaseControl>().len(), 4, "until it answers");
    bench.hear(PEER, &confirm(0));
    assert_eq!(bench.sent::<ReleaseControl>().len(), 1);
    bench.hear(PEER, &reject(0));
    bench.run_ms(1000);
    assert_eq!(bench.sent::<ReleaseControl>(), [], "it has answered");
    bench.hear(PEER, &confirm(0));
    assert_eq!(
        bench.sent::<ReleaseControl>().len(),
        1,
        "a late confirmation"
    );
    let [ControlNews::Refused(_)] = news(&mut bench)[..] else {
        panic!("the application knows that the request is over");
    };
}

#[test]
fn a_peer_that_was_started_again_is_lost_and_the_control_that_it_grants_anew_given_back() {
    let (mut bench, _) = held(5);
    bench.run_ms(300);
    assert_eq!(bench.sent::<QueryControl>().len(), 1, "before the renewal");
    // The peer has just restarted, has no controller, and grants the renewal as a new request.
    bench.hear(PEER, &ReportControl::default());
    bench.hear(PEER, &confirm(0));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::Restarted)]
    );
    assert_eq!(bench.sent::<ReleaseControl>().len(), 1);
}

/// A bench whose first request was given up, with a release that is still in flight when the second
/// request is granted.
fn held_before_the_release_arrives() -> Bench {
    let mut bench = Bench::new();
    request(&mut bench);
    bench.run_ms(3000);
    let [ControlNews::Refused(ControlRefused::NoAnswer(_))] = news(&mut bench)[..] else {
        panic!("it is given up");
    };
    assert_eq!(bench.sent::<ReleaseControl>().len(), 4, "every 0.5 s");
    request(&mut bench);
    bench.hear(PEER, &confirm(0));
    assert_eq!(news(&mut bench), [ControlNews::Granted]);
    bench.sent.clear();
    bench
}

#[test]
fn a_release_that_arrives_after_the_next_request_does_not_end_it() {
    let mut bench = held_before_the_release_arrives();
    bench.hear(PEER, &reject(0));
    bench.hear(PEER, &ReportControl::default());
    assert!(!bench.sent::<RequestControl>().is_empty());
    bench.hear(PEER, &confirm(0));
    renew_for(&mut bench, Duration::from_secs(5));
    assert_eq!(news(&mut bench), []);
    bench.hear(PEER, &reject(0));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::TakenBack)]
    );
}

#[test]
fn who_has_taken_control_after_a_late_release_keeps_it() {
    let mut bench = held_before_the_release_arrives();
    bench.hear(PEER, &reject(0));
    bench.hear(PEER, &confirm(2));
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::Outranked)]
    );
}

#[test]
fn a_client_tells_its_incarnation_before_it_requests_control() {
    let mut bench = Bench::new();
    request(&mut bench);
    let codes = |bench: &Bench| -> Vec<u16> {
        let sent = bench.sent.iter().filter(|(to, _)| *to == PEER);
        sent.filter_map(|(_, it)| code_of(it)).collect()
    };
    let told = [QueryIncarnation::CODE, RequestControl::CODE];
    let all = codes(&bench);
    let order: Vec<_> = all.iter().filter(|it| told.contains(it)).collect();
    assert_eq!(order, [&told[0], &told[1]], "{all:04X?}");
    // A peer whose services are not known may be another product, which is told once.
    bench.run_ms(600);
    let incarnation = bench.stack.incarnation().number();
    assert_eq!(
        bench.sent::<QueryIncarnation>(),
        [QueryIncarnation {
            sender_incarnation: incarnation,
            stamp: 0
        }]
    );
}

#[test]
fn control_is_lost_when_the_peer_is_another_incarnation() {
    let (mut bench, _) = held(4);
    let number = |incarnation| ReportIncarnation {
        incarnation,
        stamp: 0,
    };
    bench.hear(PEER, &number(7));
    bench.hear(OTHER, &number(8));
    bench.hear(PEER, &number(7));
    assert_eq!(news(&mut bench), []);
    // As a component does that has been granted a renewal as if it were a first request.
    let restarted = QueryIncarnation {
        sender_incarnation: 8,
        stamp: 0,
    };
    bench.hear(PEER, &restarted);
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::Restarted)]
    );
}

/// A peer without the service Incarnation, under control of `controller`, answers for a while.
fn answer_for(bench: &mut Bench, duration: Duration, controller: JausId) {
    let end = bench.now + duration;
    while bench.now < end {
        bench.run_ms(10);
        for (_, payload) in std::mem::take(&mut bench.sent) {
            match code_of(&payload) {
                Some(RequestControl::CODE) => bench.hear(PEER, &confirm(0)),
                Some(QueryControl::CODE) => bench.hear(PEER, &controlled_by(controller)),
                Some(QueryStatus::CODE) => bench.hear(PEER, &status(1)),
                _ => {}
            }
        }
    }
}

/// Control of such a peer, whose numbers begin anew after 9 s.
fn held_until_numbers_begin_anew() -> Bench {
    let (mut bench, _) = held(5);
    bench.number = Some(30);
    answer_for(&mut bench, Duration::from_secs(9), CLIENT);
    assert_eq!(news(&mut bench), [ControlNews::Status(1)]);
    bench.number = Some(1);
    bench
}

#[test]
fn control_is_lost_within_half_a_second_when_the_numbers_of_a_foreign_peer_begin_anew() {
    let mut bench = held_until_numbers_begin_anew();
    // Its new process says that it is ready, too.
    answer_for(&mut bench, Duration::from_millis(500), OTHER);
    assert_eq!(
        news(&mut bench),
        [ControlNews::Lost(ControlLost::Restarted)]
    );
}

#[test]
fn control_is_kept_when_a_foreign_peer_counts_anew_and_knows_its_client() {
    let mut bench = held_until_numbers_begin_anew();
    answer_for(&mut bench, Duration::from_secs(20), CLIENT);
    assert_eq!(news(&mut bench), []);
}

#[test]
fn control_is_kept_when_the_numbers_of_a_foreign_peer_wrap() {
    let (mut bench, _) = held(5);
    bench.number = Some(65_500);
    answer_for(&mut bench, Duration::from_secs(20), CLIENT);
    assert!(bench.number.is_some_and(|number| number < 1000));
    assert_eq!(news(&mut bench), [ControlNews::Status(1)]);
}
