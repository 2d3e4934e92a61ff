//! Types that implement the generated trait of a service.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::component::{Component, Kind, LaterAnswer};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, QueryWrenchEffort, ReportVelocityState,
    ReportVelocityStateExt, ReportWrenchEffort, SetWrenchEffort, primitive_driver,
    velocity_state_sensor,
};
use jaus::node::{Config, Node};
use jaus::service::rig::{CLIENT, Rig, STRANGER};
use jaus::service::{Call, Handlers, Service, State, UnsafeService, Validity};
use jaus_test_kit::waiting::within_limit;
use tokio::sync::mpsc;

/// A motor that records whether it turns.
#[derive(Clone, Default)]
struct Motor {
    turns: Arc<Mutex<bool>>,
    validity: Option<Validity>,
}

impl primitive_driver::Service<Call<'_>> for Motor {
    fn set_wrench_effort(&mut self, _: SetWrenchEffort, call: &mut Call<'_>) {
        *self.turns.lock().unwrap() = true;
        if let Some(validity) = self.validity {
            call.set_validity(validity);
        }
    }

    fn query_wrench_effort(
        &mut self,
        _: QueryWrenchEffort,
        call: &mut Call<'_>,
    ) -> Option<ReportWrenchEffort> {
        (call.source() == Some(CLIENT)).then(ReportWrenchEffort::default)
    }

    fn stop(&mut self, _: &mut Call<'_>) {
        *self.turns.lock().unwrap() = false;
    }
}

fn driver(motor: &Motor) -> Handlers<primitive_driver::Server<Motor>> {
    Handlers::of(primitive_driver::Server::new(motor.clone()))
}

#[test]
fn a_command_is_guarded_because_its_definition_says_so() {
    let motor = Motor::default();
    let turns = || *motor.turns.lock().unwrap();
    let mut rig = Rig::new(vec![Box::new(driver(&motor))]);
    let effort = SetWrenchEffort::default();
    for (state, source, expected) in [
        (State::Ready, STRANGER, false),
        (State::Standby, CLIENT, false),
        (State::Ready, CLIENT, true),
    ] {
        rig.stand(state, Some(CLIENT));
        rig.send(source, &effort);
        assert_eq!(turns(), expected, "{state}, {source}");
    }
    rig.stand(State::Emergency, Some(CLIENT));
    assert!(!turns(), "stopped by the emergency");
}

#[test]
fn a_command_expires_unless_it_sets_another_validity() {
    for (validity, turns_later) in [(None, false), (Some(Validity::UntilDone), true)] {
        let motor = Motor {
            validity,
            ..Motor::default()
        };
        let mut rig = Rig::new(vec![Box::new(driver(&motor))]);
        rig.send(CLIENT, &SetWrenchEffort::default());
        rig.run(Duration::from_millis(499));
        assert!(*motor.turns.lock().unwrap());
        rig.run(Duration::from_secs(5));
        assert_eq!(*motor.turns.lock().unwrap(), turns_later);
    }
}

#[test]
fn a_query_can_be_declined() {
    let mut rig = Rig::new(vec![Box::new(driver(&Motor::default()))]);
    let query = QueryWrenchEffort::all();
    assert_eq!(rig.ask::<ReportWrenchEffort>(&query), None, "a stranger");
    rig.send(CLIENT, &query);
    assert!(rig.answer::<ReportWrenchEffort>().is_some());
}

#[tokio::test]
async fn a_driver_without_management_cannot_be_attached() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let rover = Component::builder(Kind::Vehicle, "Rover").offer(driver(&Motor::default()));
    let error = rover.attach(&node, 33).unwrap_err();
    let expected = UnsafeService::NoManagement {
        service: primitive_driver::LATEST,
        command: "SetWrenchEffort",
    };
    assert_eq!(error, expected.into());
    assert!(driver(&Motor::default()).hazards().stops);
}

/// A speedometer that answers from another task.
struct Slow(mpsc::UnboundedSender<LaterAnswer<QueryVelocityState>>);

impl velocity_state_sensor::Service<Call<'_>> for Slow {
    fn query_velocity_state(
        &mut self,
        _: QueryVelocityState,
        call: &mut Call<'_>,
    ) -> Option<ReportVelocityState> {
        self.0.send(call.later()?).ok()?;
        None
    }

    fn query_velocity_state_ext(
        &mut self,
        _: QueryVelocityStateExt,
        _: &mut Call<'_>,
    ) -> Option<ReportVelocityStateExt> {
        None
    }
}

#[tokio::test]
async fn a_query_can_be_answered_later() {
    let node = Node::start(Config::loopback(101, 1)).unwrap();
    let (queries, mut waiting) = mpsc::unbounded_channel();
    let server = velocity_state_sensor::Server::new(Slow(queries));
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::of(server))
        .attach(&node, 33)
        .unwrap();
    let id = rover.id();
    let answering = tokio::spawn(async move {
        while let Some(later) = waiting.recv().await {
            let mut report = ReportVelocityState::default();
            report.set_velocity_x_m_per_s(1.5).unwrap();
            report.set_velocity_y_m_per_s(0.5).unwrap();
            rover.answer(later, report).unwrap();
        }
    });
    let client = Component::builder(Kind::OperatorControlUnit, "Client");
    let client = client.attach(&node, 1).unwrap();
    let query = QueryVelocityState::none().with_velocity_x();
    let report = within_limit(client.query(id, &query)).await.unwrap();
    assert!(
        report
            .velocity_x_m_per_s()
            .is_some_and(|it| (it - 1.5).abs() < 0.01)
    );
    assert_eq!(report.velocity_y, None, "it was not requested");
    answering.abort();
}
