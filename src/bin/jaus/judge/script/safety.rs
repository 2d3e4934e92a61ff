//! Part C: what the contests' judges look for besides answers. A vehicle moves only for the client
//! in control and only when it is ready, and stops when either ends, or in an emergency.

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
    Step, Until, present, step,
};
use super::challenge::{accepted, released, request_control};
use super::{ACCESS_CONTROL, MANAGEMENT, PRIMITIVE_DRIVER, VELOCITY_STATE_SENSOR};

/// The effort forwards, in percent: enough to move, not to rush.
const EFFORT: f64 = 30.0;
/// In metres a second: below it, a vehicle stands.
const STANDING: f64 = 0.05;
/// How long a vehicle that must not move is watched.
const PATIENCE: Duration = Duration::from_millis(500);
/// How long a vehicle may take to move, or to stop.
const RESPONSE: Duration = Duration::from_secs(4);
const ROUND: Duration = Duration::from_millis(100);

pub(super) fn steps() -> Vec<Step> {
    vec![
        safety(1, "No motion for who is not in control")
            .act(effort(Second).into())
            .act(Act::Pause(PATIENCE))
            .ask(Main, query_velocity(), "at rest", stands),
        in_control(2, "No motion in standby")
            .act(effort(Main).into())
            .act(Act::Pause(PATIENCE))
            .ask(Main, query_velocity(), "at rest", stands),
        driving(3, "Standby stops the vehicle")
            .tell(Main, Standby)
            .act(until_it_stands()),
        driving(4, "An emergency stops the vehicle")
            .tell(
                Fourth,
                SetEmergency {
                    emergency_code: set_emergency::EmergencyCode(1),
                },
            )
            .act(until_it_stands())
            .finally(Exchange::new(
                Fourth,
                ClearEmergency {
                    emergency_code: clear_emergency::EmergencyCode(1),
                },
            )),
        driving(5, "The end of control stops the vehicle")
            .ask(Main, ReleaseControl, "control released", released)
            .act(until_it_stands()),
    ]
}

fn safety(number: u8, title: &'static str) -> Step {
    step(Part::C, number, title).needs(&[
        ACCESS_CONTROL,
        MANAGEMENT,
        PRIMITIVE_DRIVER,
        VELOCITY_STATE_SENSOR,
    ])
}

/// A step that begins with control, and ends without it, in standby.
fn in_control(number: u8, title: &'static str) -> Step {
    safety(number, title)
        .ask::<ConfirmControl>(Main, request_control(), "control accepted", accepted)
        .finally(Exchange::new(Main, Standby))
        .afterwards::<RejectControl>(Main, ReleaseControl)
}

/// A step that begins with a vehicle that moves.
fn driving(number: u8, title: &'static str) -> Step {
    let mut step = in_control(number, title)
        .tell(Main, Resume)
        .act(effort(Main).into());
    step.acts.push(Act::Until(Until {
        words: "the vehicle moves",
        exchanges: vec![effort(Main), ask_velocity()],
        reached: |memory| match memory.speed {
            Some(speed) if speed.abs() > STANDING => Ok(()),
            _ => Err("the vehicle did not move".to_owned()),
        },
        every: ROUND,
        at_most: RESPONSE,
    }));
    step
}

fn until_it_stands() -> Act {
    Act::Until(Until {
        words: "the vehicle stands",
        exchanges: vec![ask_velocity()],
        reached: |memory| match memory.speed {
            Some(speed) if speed.abs() <= STANDING => Ok(()),
            speed => Err(format!(
                "the vehicle still moves at {:.2} m/s",
                speed.unwrap_or(f64::NAN)
            )),
        },
        every: ROUND,
        at_most: RESPONSE,
    })
}

/// Pushes forwards.
fn effort(from: super::super::step::Speaker) -> Exchange {
    Exchange::with(from, |_| {
        let mut message = SetWrenchEffort::default();
        let set = message.set_propulsive_linear_effort_x_percent(EFFORT);
        set.map_err(|error| error.to_string())?;
        Ok(message)
    })
}

const fn query_velocity() -> QueryVelocityState {
    // Velocity X.
    QueryVelocityState { presence_vector: 1 }
}

fn ask_velocity() -> Exchange {
    Exchange::new(Main, query_velocity()).expect(Main, "velocity X", takes_velocity)
}

fn takes_velocity(report: &ReportVelocityState, memory: &mut Memory) -> Check {
    memory.speed = Some(present("velocity X", report.velocity_x_m_per_s())?);
    Ok(())
}

fn stands(report: &ReportVelocityState, memory: &mut Memory) -> Check {
    takes_velocity(report, memory)?;
    match memory.speed {
        Some(speed) if speed.abs() > STANDING => {
            Err(format!("the vehicle moves at {speed:.2} m/s"))
        }
        _ => Ok(()),
    }
}
