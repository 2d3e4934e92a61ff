//! Sequence numbers and timeouts of report streams.

use super::Bench;
use super::subscriptions::{Notice, confirm, fire, notices, status, subscribe, up};
use crate::messages::core::{CancelEvent, CreateEvent};
use crate::service::{Outage, When};

#[test]
fn gaps_in_the_numbers_are_lost_reports_and_repetitions_are_no_reports() {
    let (mut bench, _) = up(When::hz(100.0));
    for sequence in [254, 254, 255, 2, 1, 3] {
        fire(&mut bench, 7, sequence);
    }
    let report = |lost| Notice::Report { lost };
    assert_eq!(
        notices(&mut bench),
        [report(0), report(0), report(2), report(0)]
    );
}

#[test]
fn a_periodic_event_that_stops_is_down_until_it_is_confirmed_again() {
    let (mut bench, _) = up(When::hz(2.0));
    fire(&mut bench, 7, 0);
    bench.run_ms(1900);
    assert_eq!(notices(&mut bench), [Notice::Report { lost: 0 }]);
    bench.run_ms(200);
    assert_eq!(notices(&mut bench), [Notice::Down(Outage::Silent)]);
    bench.run_ms(60_000);
    let attempts = bench.sent::<CreateEvent>();
    assert!((10..20).contains(&attempts.len()), "{}", attempts.len());
    // The event returns with another number.
    confirm(&mut bench, attempts[0].request_id, 1, 2.0);
    fire(&mut bench, 1, 0);
    assert_eq!(
        notices(&mut bench),
        [Notice::Up(Some(2)), Notice::Report { lost: 0 }]
    );
}

#[test]
fn a_stream_that_goes_on_by_itself_is_up_again() {
    let (mut bench, _) = up(When::hz(10.0));
    fire(&mut bench, 7, 0);
    bench.run_ms(2100);
    fire(&mut bench, 7, 6);
    assert_eq!(
        notices(&mut bench),
        [
            Notice::Report { lost: 0 },
            Notice::Down(Outage::Silent),
            Notice::Up(Some(10)),
            Notice::Report { lost: 5 }
        ]
    );
}

/// JAUS++ sends the first report at once, and starts its periods some time later.
#[test]
fn a_stream_that_begins_a_second_after_its_first_report_is_not_down() {
    let (mut bench, _) = up(When::hz(25.0));
    fire(&mut bench, 7, 0);
    bench.run_ms(1000);
    assert_eq!(notices(&mut bench), [Notice::Report { lost: 0 }]);
    for sequence in 1..=50 {
        fire(&mut bench, 7, sequence);
        bench.run_ms(40);
    }
    notices(&mut bench);
    bench.run_ms(500);
    assert_eq!(notices(&mut bench), [Notice::Down(Outage::Silent)]);
}

#[test]
fn numbers_that_the_rate_cannot_explain_are_no_lost_reports() {
    let (mut bench, _) = up(When::hz(10.0));
    fire(&mut bench, 7, 0);
    bench.run_ms(100);
    fire(&mut bench, 7, 90);
    bench.run_ms(100);
    fire(&mut bench, 7, 91);
    bench.run_ms(300);
    fire(&mut bench, 7, 94);
    let report = |lost| Notice::Report { lost };
    let reports = [report(0), report(0), report(0), report(2)];
    assert_eq!(notices(&mut bench), reports);
}

#[test]
fn a_peer_that_confirms_late_keeps_one_event_and_is_asked_no_more() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(10.0)));
    bench.run_ms(600);
    let asked = bench.sent::<CreateEvent>();
    assert_eq!(asked.len(), 2, "it is slower than the first repetition");
    // It makes an event of each request.
    confirm(&mut bench, asked[0].request_id, 1, 10.0);
    bench.run_ms(500);
    confirm(&mut bench, asked[1].request_id, 2, 10.0);
    let cancelled = bench.sent::<CancelEvent>();
    assert!(matches!(cancelled[..], [CancelEvent { event_id: 2, .. }]));
    for sequence in 0..100 {
        fire(&mut bench, 1, sequence);
        bench.run_ms(100);
        assert_eq!(bench.sent::<CreateEvent>(), []);
    }
    let is_down = |it: &Notice| matches!(it, Notice::Down(_) | Notice::Ended(_));
    assert!(!notices(&mut bench).iter().any(is_down));
}
