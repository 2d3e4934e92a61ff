//! Events that stop a moving component: its end, a panic, a hang, a failure.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::time::{Duration, Instant};

use super::*;
use crate::codec::ServiceId;
use crate::endpoint::Received;
use crate::service::{Context, Handled, Handlers, Service, StopCause, Validity, code_of};

/// Handlers that count their stops.
fn mover(stops: &Arc<AtomicU32>) -> Handlers {
    let stops = Arc::clone(stops);
    Handlers::new(list_manager::LATEST)
        .command_valid(Validity::UntilDone, |_: DeleteElement, _, _| {})
        .on_stop(move |_| _ = stops.fetch_add(1, Relaxed))
}

fn moving() -> (Rig, Arc<AtomicU32>) {
    let stops = Arc::new(AtomicU32::new(0));
    let lasting = Management::new().access_control(AccessControl::new().timeout(0));
    let services: Vec<Box<dyn Service>> = vec![Box::new(mover(&stops))];
    let mut rig = Rig::new(services, |stack| stack.management(lasting));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    rig.hear(FIRST, &DeleteElement::default());
    stops.store(0, Relaxed);
    (rig, stops)
}

#[test]
fn a_component_that_was_held_up_stops_and_drops_control_before_it_handles_what_has_waited() {
    let (mut rig, stops) = moving();
    rig.run(Duration::from_secs(3));
    assert_eq!((stops.load(Relaxed), rig.state()), (0, State::Ready));
    // The component is not called for this long; then it first handles a command of its client.
    rig.now += Duration::from_secs(3);
    rig.hear(FIRST, &DeleteElement::default());
    assert_eq!((rig.controller(), rig.state()), (None, State::Standby));
    assert!(stops.load(Relaxed) > 0);
    rig.run(Duration::from_secs(10));
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_command_that_has_waited_longer_than_control_lasted_is_not_carried_out() {
    let count = Arc::new(AtomicU32::new(0));
    let counted = Arc::clone(&count);
    let job = Handlers::new(list_manager::LATEST)
        .command(move |_: DeleteElement, _, _| _ = counted.fetch_add(1, Relaxed))
        .on_stop(|_| {});
    let services: Vec<Box<dyn Service>> = vec![Box::new(job)];
    let mut rig = Rig::new(services, |stack| stack.management(Management::new()));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    rig.now += Duration::from_secs(6);
    rig.hear(FIRST, &DeleteElement::default());
    assert_eq!(count.load(Relaxed), 0);
}

#[test]
fn a_component_that_ends_stops_and_obeys_nobody_any_more() {
    let (mut rig, stops) = moving();
    rig.stack.take_leave(rig.now);
    assert!(stops.load(Relaxed) > 0);
    assert_eq!((rig.controller(), rig.state()), (None, State::Shutdown));
    let (rig, stops) = moving();
    drop(rig);
    assert!(stops.load(Relaxed) > 0, "also when it is just dropped");
}

#[test]
fn a_stop_action_runs_when_a_handler_panics() {
    let stops = Arc::new(AtomicU32::new(0));
    let panics =
        mover(&stops).command(|_: SetElement, _, _| panic!("a mistake of the application"));
    let services: Vec<Box<dyn Service>> = vec![Box::new(panics)];
    let mut rig = Rig::new(services, |stack| stack.management(Management::new()));
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    stops.store(0, Relaxed);
    let run = std::panic::AssertUnwindSafe(move || rig.hear(FIRST, &SetElement::default()));
    assert!(std::panic::catch_unwind(run).is_err());
    assert!(stops.load(Relaxed) > 0);
}

/// Fails and recovers on request.
struct Fragile(Arc<AtomicU32>);

impl Service for Fragile {
    fn offers(&self) -> Vec<ServiceId> {
        vec![list_manager::LATEST]
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        if code_of(&message.payload) != Some(QueryElementCount::CODE) {
            return Handled::No;
        }
        match self.0.swap(0, Relaxed) {
            1 => context.fail(StopCause::Fault("no current".to_owned())),
            2 => context.recover(),
            _ => {}
        }
        context.reply(message, &ReportElementCount::default());
        Handled::Yes
    }
}

const FAIL: u32 = 1;
const RECOVER: u32 = 2;

/// A component with a service that carries out the order that it finds when it is queried.
fn fragile(settings: Management) -> (Rig, Arc<AtomicU32>) {
    let order = Arc::new(AtomicU32::new(0));
    let services: Vec<Box<dyn Service>> = vec![Box::new(Fragile(Arc::clone(&order)))];
    let rig = Rig::new(services, |stack| stack.management(settings));
    (rig, order)
}

#[test]
fn a_failure_lasts_until_both_the_services_and_the_application_are_well() {
    let (mut rig, order) = fragile(Management::new());
    let tell = |rig: &mut Rig, what| {
        order.store(what, Relaxed);
        rig.hear(SECOND, &QueryElementCount);
    };
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    tell(&mut rig, FAIL);
    assert_eq!((rig.controller(), rig.state()), (None, State::Failure));
    rig.stack.set_condition(rig.now, Condition::Failed);
    tell(&mut rig, RECOVER);
    assert_eq!(
        rig.state(),
        State::Failure,
        "the application has failed, too"
    );
    rig.stack.set_condition(rig.now, Condition::Initialized);
    assert_eq!(rig.state(), State::Standby);
}

#[test]
fn a_failure_of_a_service_ends_with_its_recovery_and_shows_after_other_states() {
    let initializing = Management::new().initializes();
    let initialized = |rig: &mut Rig| rig.stack.set_condition(rig.now, Condition::Initialized);
    let stop = |rig: &mut Rig| _ = rig.hear(THIRD, &STOP);
    let clear = |rig: &mut Rig| _ = rig.hear(THIRD, &CLEAR);
    let nothing = |_: &mut Rig| {};
    type Step = fn(&mut Rig);
    let cases: [(Management, Step, Step, State, State); 3] = [
        (
            Management::new(),
            nothing,
            nothing,
            State::Failure,
            State::Standby,
        ),
        (
            Management::new(),
            stop,
            clear,
            State::Emergency,
            State::Emergency,
        ),
        (
            initializing,
            nothing,
            initialized,
            State::Initialize,
            State::Initialize,
        ),
    ];
    for (settings, before, after, shown, recovered) in cases {
        let (mut rig, order) = fragile(settings);
        let tell = |rig: &mut Rig, what, expected| {
            order.store(what, Relaxed);
            rig.hear(SECOND, &QueryElementCount);
            assert_eq!(rig.state(), expected);
        };
        before(&mut rig);
        tell(&mut rig, FAIL, shown);
        tell(&mut rig, RECOVER, recovered);
        tell(&mut rig, FAIL, shown);
        after(&mut rig);
        assert_eq!(rig.state(), State::Failure);
        tell(&mut rig, RECOVER, State::Standby);
    }
}

#[test]
fn a_fault_that_is_found_while_an_event_is_answered_counts() {
    let (mut rig, order) = fragile(Management::new());
    let create = CreateEvent {
        request_id: 1,
        event_type: 0.into(),
        query_message: QueryElementCount.encode().unwrap(),
        ..CreateEvent::default()
    };
    let mut create = create;
    create.set_requested_periodic_rate_hz(1.0).unwrap();
    rig.hear(SECOND, &create);
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    order.store(FAIL, Relaxed);
    rig.run(Duration::from_secs(2));
    assert_eq!(rig.state(), State::Failure);
}
