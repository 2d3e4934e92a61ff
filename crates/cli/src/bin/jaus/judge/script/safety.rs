//! Part C: safety checks of the contests' judges. A vehicle moves only for the client in control
//! and only in the ready state; it stops when either ends, or in an emergency.

use std::time::Duration;

use jaus::messages::core::{
    ClearEmergency, ConfirmControl, RejectControl, ReleaseControl, Resume, SetEmergency, Standby,
    clear_emergency, set_emergency,
};
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, SetWrenchEffort};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Part,
    Speaker::{Fourth, Main, Second},
    Step, Throughout, Until, present, step,
};
use super::challenge::{accepted, released, request_control};
use super::{ACCESS_CONTROL, MANAGEMENT, PRIMITIVE_DRIVER, VELOCITY_STATE_SENSOR};

/// Forward effort, in percent: enough for a slow motion.
const EFFORT: f64 = 30.0;
/// Speed of a standing vehicle, in m/s at most.
const STANDING: f64 = 0.05;
/// Duration of efforts that must have no effect. An effort may expire by itself, after 500 ms in
/// this stack: only a vehicle under constant efforts shows that it ignores them.
const PROVOCATION: Duration = Duration::from_secs(3);
/// Time limit for a vehicle to move or stop.
const RESPONSE: Duration = Duration::from_secs(4);
/// Repetition interval of efforts and control requests.
const ROUND: Duration = Duration::from_millis(100);

pub(super) fn steps() -> Vec<Step> {
    vec![
        safety(1, "No motion without control").act(stands_throughout(|| vec![effort(Second)])),
        in_control(2, "No motion in standby")
            .act(stands_throughout(|| vec![renew(), effort(Main)])),
        driving(3, "Standby stops the vehicle")
            .tell(Main, Standby)
            .act(until_it_stands(|| vec![renew(), effort(Main)]))
            .act(stands_throughout(|| vec![renew(), effort(Main)])),
        driving(4, "An emergency stops the vehicle")
            .tell(
                Fourth,
                SetEmergency {
                    emergency_code: set_emergency::EmergencyCode(1),
                },
            )
            .act(until_it_stands(|| vec![effort(Main)]))
            .act(stands_throughout(|| vec![effort(Main)]))
            .finally(Exchange::new(
                Fourth,
                ClearEmergency {
                    emergency_code: clear_emergency::EmergencyCode(1),
                },
            )),
        driving(5, "Loss of control stops the vehicle")
            .ask(Main, ReleaseControl, "control released", released)
            .act(until_it_stands(|| vec![effort(Main)]))
            .act(stands_throughout(|| vec![effort(Main)])),
    ]
}

fn safety(number: u16, title: &'static str) -> Step {
    step(Part::C, number, title).needs(&[
        ACCESS_CONTROL,
        MANAGEMENT,
        PRIMITIVE_DRIVER,
        VELOCITY_STATE_SENSOR,
    ])
}

/// A step that starts in control, and ends without control, in standby.
fn in_control(number: u16, title: &'static str) -> Step {
    safety(number, title)
        .ask::<ConfirmControl>(Main, request_control(), "control accepted", accepted)
        .finally(Exchange::new(Main, Standby))
        .afterwards::<RejectControl>(Main, ReleaseControl)
}

/// A step that starts with a moving vehicle.
fn driving(number: u16, title: &'static str) -> Step {
    let mut step = in_control(number, title).tell(Main, Resume);
    step.acts.push(Act::Until(Until {
        words: "the vehicle moves",
        exchanges: vec![renew(), effort(Main), ask_velocity()],
        reached: |memory| match memory.speed {
            Some(speed) if speed.abs() > STANDING => Ok(()),
            _ => Err("the vehicle did not move".to_owned()),
        },
        every: ROUND,
        at_most: RESPONSE,
    }));
    step
}

/// The vehicle stops although the commands continue.
fn until_it_stands(commands: fn() -> Vec<Exchange>) -> Act {
    Act::Until(Until {
        words: "the vehicle stands while efforts continue",
        exchanges: and_velocity(commands),
        reached: stands,
        every: ROUND,
        at_most: RESPONSE,
    })
}

/// The vehicle does not move while the commands continue.
fn stands_throughout(commands: fn() -> Vec<Exchange>) -> Act {
    Act::Throughout(Throughout {
        words: "the vehicle stands while efforts continue",
        exchanges: and_velocity(commands),
        holds: stands,
        every: ROUND,
        lasting: PROVOCATION,
    })
}

fn and_velocity(commands: fn() -> Vec<Exchange>) -> Vec<Exchange> {
    let mut exchanges = commands();
    exchanges.push(ask_velocity());
    exchanges
}

/// Renews control: some subjects revoke it otherwise.
fn renew() -> Exchange {
    Exchange::new(Main, request_control()).expect(Main, "control accepted", accepted)
}

/// Sends a forward effort.
fn effort(from: super::super::step::Speaker) -> Exchange {
    Exchange::with(from, |_| {
        let mut message = SetWrenchEffort::default();
        let set = message.set_propulsive_linear_effort_x_percent(EFFORT);
        set.map_err(|error| error.to_string())?;
        Ok(message)
    })
}

const fn query_velocity() -> QueryVelocityState {
    QueryVelocityState::none().with_velocity_x()
}

fn ask_velocity() -> Exchange {
    Exchange::new(Main, query_velocity()).expect(Main, "velocity X", takes_velocity)
}

fn takes_velocity(report: &ReportVelocityState, memory: &mut Memory) -> Check {
    memory.speed = Some(present("velocity X", report.velocity_x_m_per_s())?);
    Ok(())
}

fn stands(memory: &Memory) -> Check {
    match memory.speed {
        Some(speed) if speed.abs() <= STANDING => Ok(()),
        Some(speed) => Err(format!("the vehicle moves at {speed:.2} m/s")),
        None => Err("the vehicle has not reported its velocity".to_owned()),
    }
}
