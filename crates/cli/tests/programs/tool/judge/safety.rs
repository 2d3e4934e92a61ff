//! Part C against vehicles that violate one of the rules: each fails in the step about that rule,
//! even if its efforts expire, and passes the others.

use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Received;
use jaus::messages::core::confirm_control::ResponseCode;
use jaus::messages::core::{
    ClearEmergency, ConfirmControl, RejectControl, ReleaseControl, RequestControl, Resume,
    SetEmergency, Standby, access_control, management, reject_control,
};
use jaus::messages::mobility::{
    QueryVelocityState, ReportVelocityState, SetWrenchEffort, primitive_driver,
    velocity_state_sensor,
};

use crate::support::run;
use crate::tool::judge::peer::{Peer, network};

/// The rule that a vehicle violates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ignores {
    Nothing,
    /// It obeys every client, in control or not, before and after control.
    Control,
    /// It drives in standby.
    Standby,
    /// It drives in an emergency.
    Emergency,
    /// It drives for a client that has released control.
    Release,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Ready,
    Standby,
    Emergency,
}

/// A vehicle that starts and stops at once.
struct Rover {
    ignores: Ignores,
    /// How long an effort is valid.
    validity: Duration,
    state: State,
    controller: Option<JausId>,
    last_controller: Option<JausId>,
    effort: Option<Instant>,
}

impl Rover {
    fn new(ignores: Ignores, validity: Duration) -> Self {
        Self {
            ignores,
            validity,
            state: State::Standby,
            controller: None,
            last_controller: None,
            effort: None,
        }
    }

    fn may_drive(&self, client: JausId) -> bool {
        let is_in_control = match self.ignores {
            Ignores::Control => true,
            Ignores::Release => self.controller.or(self.last_controller) == Some(client),
            _ => self.controller == Some(client),
        };
        let may_act = match self.state {
            State::Ready => true,
            State::Standby => matches!(self.ignores, Ignores::Standby | Ignores::Control),
            State::Emergency => self.ignores == Ignores::Emergency,
        };
        is_in_control && may_act
    }

    fn stop_if_told(&mut self, client: JausId) {
        if !self.may_drive(client) {
            self.effort = None;
        }
    }

    fn handle(&mut self, message: &Received) -> Option<Bytes> {
        let (code, client) = (
            u16::from_le_bytes(*message.payload.first_chunk()?),
            message.source,
        );
        match code {
            RequestControl::CODE => {
                let is_free = self.state != State::Emergency;
                let accepted = [ResponseCode::NOT_AVAILABLE, ResponseCode::CONTROL_ACCEPTED];
                if is_free {
                    self.controller = Some(client);
                }
                let response_code = accepted[usize::from(is_free)];
                return ConfirmControl { response_code }.encode().ok();
            }
            ReleaseControl::CODE => {
                self.last_controller = self.controller.take().or(self.last_controller);
                self.stop_if_told(client);
                let response_code = reject_control::ResponseCode::CONTROL_RELEASED;
                return RejectControl { response_code }.encode().ok();
            }
            Resume::CODE if self.state == State::Standby => self.state = State::Ready,
            Standby::CODE if self.state == State::Ready => {
                self.state = State::Standby;
                self.stop_if_told(client);
            }
            SetEmergency::CODE => {
                self.state = State::Emergency;
                let controller = self.controller.unwrap_or(client);
                self.stop_if_told(controller);
            }
            ClearEmergency::CODE => (self.state, self.effort) = (State::Standby, None),
            SetWrenchEffort::CODE if self.may_drive(client) => self.effort = Some(Instant::now()),
            QueryVelocityState::CODE => {
                let moves = self.effort.is_some_and(|at| at.elapsed() < self.validity);
                let mut report = ReportVelocityState::default();
                report
                    .set_velocity_x_m_per_s(if moves { 1.0 } else { 0.0 })
                    .unwrap();
                return report.encode().ok();
            }
            _ => {}
        }
        None
    }
}

/// The verdicts of steps C1 to C5, and the reasons of failed steps.
fn judge(ignores: Ignores, validity: Duration) -> (Vec<String>, String) {
    let flags = network();
    let mut rover = Rover::new(ignores, validity);
    let peer = Peer::offering(&[
        access_control::URN,
        management::URN,
        primitive_driver::URN,
        velocity_state_sensor::URN,
    ]);
    let _peer = peer
        .behaves(move |message| rover.handle(message))
        .start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--unicast", "--json", "--only", "C1-C5"];
    let judged = run(&[&judge, &*network].concat(), b"");
    let lines = judged.json();
    let steps = lines.iter().filter(|line| line["verdict"].is_string());
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let verdicts = steps.clone().map(|line| text(&line["verdict"]));
    let reasons: Vec<_> = steps.map(|line| text(&line["reason"])).collect();
    (verdicts.collect(), reasons.join("; "))
}

/// Efforts expire, as in this stack; the judge repeats them within this time.
const EXPIRES: Duration = Duration::from_millis(500);
/// Efforts outlast the run.
const LASTS: Duration = Duration::from_secs(3600);

#[track_caller]
fn fails_in(ignores: Ignores, steps: &[usize]) {
    for validity in [EXPIRES, LASTS] {
        let (verdicts, reasons) = judge(ignores, validity);
        let expected = |step| {
            if steps.contains(&step) {
                "failed"
            } else {
                "ok"
            }
        };
        let expected: Vec<_> = (1..=5).map(expected).collect();
        assert_eq!(verdicts, expected, "{ignores:?} {validity:?}: {reasons}");
        if !steps.is_empty() {
            assert!(
                reasons.contains("the vehicle moves at 1.00 m/s"),
                "{reasons}"
            );
        }
    }
}

#[test]
fn a_vehicle_that_obeys_the_rules_passes() {
    fails_in(Ignores::Nothing, &[]);
}

#[test]
fn a_vehicle_that_obeys_every_client_fails_although_its_efforts_expire() {
    fails_in(Ignores::Control, &[1, 2, 3, 5]);
}

#[test]
fn a_vehicle_that_drives_on_in_standby_fails_although_its_efforts_expire() {
    fails_in(Ignores::Standby, &[2, 3]);
}

#[test]
fn a_vehicle_that_drives_on_in_an_emergency_fails_although_its_efforts_expire() {
    fails_in(Ignores::Emergency, &[4]);
}

#[test]
fn a_vehicle_that_drives_on_for_a_client_without_control_fails_although_its_efforts_expire() {
    fails_in(Ignores::Release, &[5]);
}
