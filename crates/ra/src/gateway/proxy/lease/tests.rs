//! Tests of lease and release.

use super::super::codes::{QUERY_CONTROL, RELEASE_CONTROL, SET_SPEED, STANDBY};
use super::*;

const OWN: RaId = RaId::new(250, 1, 32, 1);
const RA: RaId = RaId::new(20, 1, 45, 1);
const STOP: (u16, Bytes) = (SET_SPEED, Bytes::from_static(&[0, 0]));
const CLIENT: JausId = JausId::new(42, 1, 1);
const RIVAL: JausId = JausId::new(43, 1, 1);

fn lease() -> (Lease, Instant) {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    let now = Instant::now();
    let terms = Terms {
        patience: Duration::from_secs(1),
        authority: 200,
        timeout: Duration::from_secs(4),
    };
    let halt = Halt {
        command: Some(STOP),
    };
    (Lease::new(OWN, RA, Some(halt), terms), now)
}

/// The answers to clients: client, message code, response code.
fn told(said: &Effects) -> Vec<(JausId, u16, u8)> {
    let told = |(to, it): &(JausId, Bytes)| (*to, u16::from_le_bytes([it[0], it[1]]), it[2]);
    said.to_clients.iter().map(told).collect()
}

#[test]
fn nobody_has_control_before_the_component_has_said_so() {
    let (mut lease, now) = lease();
    lease.request(now, CLIENT, 127);
    let said = lease.take_said();
    assert_eq!(said.to_ra, [(REQUEST_CONTROL, Bytes::from_static(&[127]))]);
    assert!(told(&said).is_empty() && !lease.obeys(CLIENT));
    lease.handle_confirm(now, 0);
    assert_eq!(told(&lease.take_said()), [(CLIENT, 0x000F, 0)]);
    assert!(lease.obeys(CLIENT));
}

#[test]
fn a_component_that_says_nothing_is_asked_again_and_then_not_available() {
    let (mut lease, start) = lease();
    lease.request(start, CLIENT, 127);
    let mut requests = 0;
    while let Some(wake) = lease.poll_timeout() {
        lease.handle_timeout(wake);
        let said = lease.take_said();
        requests += said
            .to_ra
            .iter()
            .filter(|it| it.0 == REQUEST_CONTROL)
            .count();
        if !said.to_clients.is_empty() {
            assert_eq!(told(&said), [(CLIENT, 0x000F, 1)]);
            assert_eq!(wake, start + Duration::from_secs(1));
        }
    }
    assert_eq!(requests, 4, "every 0.3 s within a second");
}

#[test]
fn whoever_has_more_authority_takes_over_and_no_more_than_the_most_is_claimed() {
    let (mut lease, now) = lease();
    lease.request(now, CLIENT, 100);
    lease.handle_confirm(now, 0);
    lease.request(now, RIVAL, 100);
    let said = lease.take_said();
    assert_eq!(told(&said)[1], (RIVAL, 0x000F, 2), "not enough");
    lease.request(now, RIVAL, 255);
    let said = lease.take_said();
    assert_eq!(told(&said), [(CLIENT, 0x0010, 0)]);
    assert_eq!(said.to_ra, [(REQUEST_CONTROL, Bytes::from_static(&[200]))]);
    // OpenJAUS rejects our previous control, and then confirms.
    lease.handle_reject();
    assert!(told(&lease.take_said()).is_empty());
    lease.handle_confirm(now, 0);
    assert!(lease.obeys(RIVAL) && !lease.obeys(CLIENT));
    lease.handle_reject();
    assert!(!lease.obeys(RIVAL), "the next one is meant");
}

#[test]
fn a_client_that_raises_its_own_authority_keeps_control() {
    let (mut lease, now) = lease();
    lease.request(now, CLIENT, 100);
    lease.handle_confirm(now, 0);
    lease.request(now, CLIENT, 150);
    lease.handle_reject();
    lease.handle_confirm(now, 0);
    assert!(lease.obeys(CLIENT));
}

/// Codes of the messages to the RA component.
fn codes(said: &Effects) -> Vec<u16> {
    said.to_ra.iter().map(|it| it.0).collect()
}

/// Runs timers until a moment; collects all messages.
fn run(lease: &mut Lease, until: Instant) -> Effects {
    let mut all = Effects::default();
    while let Some(wake) = lease.poll_timeout().filter(|&wake| wake <= until) {
        lease.handle_timeout(wake);
        let said = lease.take_said();
        all.to_clients.extend(said.to_clients);
        all.to_ra.extend(said.to_ra);
    }
    all
}

/// Stop, Standby, release, and a query of the result.
const ROUND: [u16; 4] = [SET_SPEED, STANDBY, RELEASE_CONTROL, QUERY_CONTROL];

#[test]
fn a_component_is_stopped_before_it_is_released_when_its_client_releases_it_or_is_dead() {
    for dead in [false, true] {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 100);
        lease.handle_confirm(now, 0);
        lease.take_said();
        if dead {
            lease.forget(now, CLIENT);
        } else {
            lease.release(now, CLIENT);
        }
        let said = lease.take_said();
        assert_eq!(codes(&said), ROUND);
        assert_eq!(said.to_ra[0], STOP);
        assert_eq!(told(&said).len(), usize::from(!dead));
        assert!(lease.controller().is_none());
    }
}

#[test]
fn a_release_is_sent_three_times_unless_a_client_requests_control_again() {
    for requested_again in [false, true] {
        let (mut lease, now) = lease();
        lease.request(now, CLIENT, 100);
        lease.handle_confirm(now, 0);
        lease.release(now, CLIENT);
        if requested_again {
            lease.request(now, RIVAL, 50);
            lease.handle_confirm(now, 0);
        }
        let mut releases = codes(&lease.take_said());
        releases.extend(codes(&run(&mut lease, now + Duration::from_secs(4))));
        releases.retain(|&code| code == RELEASE_CONTROL);
        assert_eq!(releases.len(), if requested_again { 1 } else { 3 });
        assert_eq!(lease.obeys(RIVAL), requested_again);
    }
}

#[test]
fn a_release_is_repeated_until_the_component_reports_that_it_is_free() {
    let (mut lease, now) = lease();
    lease.request(now, CLIENT, 100);
    lease.handle_confirm(now, 0);
    lease.release(now, CLIENT);
    lease.take_said();
    lease.handle_controller(now, OWN);
    let releases = |said: &Effects| {
        said.to_ra
            .iter()
            .filter(|it| it.0 == RELEASE_CONTROL)
            .count()
    };
    let after = now + Duration::from_secs(60);
    let many = releases(&run(&mut lease, after));
    // Ten at first, then one every five seconds.
    assert!((18..=24).contains(&many), "{many}");
    lease.handle_controller(after, RaId::new(0, 0, 0, 0));
    assert_eq!(lease.poll_timeout(), None);
}

#[test]
fn control_that_is_not_renewed_ends_after_the_timeout_and_a_quarter() {
    let (mut lease, start) = lease();
    lease.request(start, CLIENT, 100);
    lease.handle_confirm(start, 0);
    let renewed = start + Duration::from_secs(3);
    lease.request(renewed, CLIENT, 100);
    lease.take_said();
    run(&mut lease, renewed + Duration::from_millis(4999));
    assert!(lease.obeys(CLIENT));
    let said = run(&mut lease, renewed + Duration::from_millis(5000));
    assert_eq!(codes(&said), ROUND);
    assert_eq!(told(&said), [(CLIENT, 0x0010, 0)]);
    assert!(!lease.obeys(CLIENT));
}

#[test]
fn a_component_that_is_held_in_our_id_is_stopped_and_released_before_a_client_gets_it() {
    let (mut lease, now) = lease();
    lease.reclaim(now);
    assert_eq!(codes(&lease.take_said()), [QUERY_CONTROL]);
    lease.request(now, CLIENT, 100);
    assert_eq!(told(&lease.take_said()), [(CLIENT, 0x000F, 1)]);
    lease.handle_controller(now, OWN);
    assert_eq!(codes(&lease.take_said()), ROUND);
    assert!(lease.is_reclaiming());
    lease.handle_controller(now, RaId::new(0, 0, 0, 0));
    assert!(!lease.is_reclaiming());
    lease.request(now, CLIENT, 100);
    assert_eq!(codes(&lease.take_said()), [REQUEST_CONTROL]);
}

#[test]
fn a_component_that_answers_no_query_is_requested_without_authority_and_released() {
    let (mut lease, now) = lease();
    lease.reclaim(now);
    let after = now + Duration::from_millis(600);
    let said = run(&mut lease, after);
    let request = (REQUEST_CONTROL, Bytes::from_static(&[0]));
    assert_eq!(said.to_ra.last(), Some(&request));
    lease.handle_confirm(after, 0);
    let said = run(&mut lease, after + Duration::from_secs(1));
    let releases = codes(&said);
    let round = [SET_SPEED, RELEASE_CONTROL, QUERY_CONTROL];
    assert_eq!(releases, [round, round, round].concat(), "and no Standby");
    assert!(!lease.is_reclaiming());
}

#[test]
fn a_component_that_another_one_controls_is_left_alone() {
    let other = RaId::new(20, 1, 40, 1);
    for reports in [false, true] {
        let (mut lease, now) = lease();
        lease.reclaim(now);
        run(&mut lease, now + Duration::from_millis(600));
        match reports {
            true => lease.handle_controller(now, other),
            false => lease.handle_reject(),
        }
        assert!(!lease.is_reclaiming());
        assert_eq!(lease.poll_timeout(), None);
    }
}

#[test]
fn a_component_that_says_nothing_is_not_available_and_is_asked_rarely_after_a_while() {
    let (mut lease, now) = lease();
    lease.reclaim(now);
    let said = run(&mut lease, now + Duration::from_secs(60));
    assert!(lease.is_reclaiming());
    let many = said.to_ra.len();
    assert!((18..=24).contains(&many), "{many}");
}

#[test]
fn a_client_is_told_when_the_component_takes_control_back() {
    let (mut lease, now) = lease();
    lease.request(now, CLIENT, 100);
    lease.handle_confirm(now, 0);
    lease.take_said();
    lease.handle_reject();
    assert_eq!(told(&lease.take_said()), [(CLIENT, 0x0010, 0)]);
    assert!(!lease.obeys(CLIENT));
}

#[test]
fn renewals_are_passed_on_now_and_then() {
    let (mut lease, start) = lease();
    lease.request(start, CLIENT, 100);
    lease.handle_confirm(start, 0);
    lease.take_said();
    let mut passed_on = 0;
    for renewal in 1..=8 {
        lease.request(start + renewal * Duration::from_millis(1250), CLIENT, 100);
        let said = lease.take_said();
        assert_eq!(told(&said), [(CLIENT, 0x000F, 0)]);
        passed_on += said.to_ra.len();
    }
    assert_eq!(passed_on, 2);
}
