//! The state of the vehicle and of the bridge, as ROS's diagnostics.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::service::State;

use super::counters::{Counter, Counters};
use super::vehicle::{Part, Role, Vehicle};

/// The levels of diagnostic_msgs/DiagnosticStatus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Level {
    /// All is well.
    Ok = 0,
    /// Something needs attention.
    Warn = 1,
    /// Something does not work.
    Error = 2,
    /// Nothing was reported lately.
    Stale = 3,
}

/// A diagnostic_msgs/DiagnosticStatus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// How well it is.
    pub level: Level,
    /// What it is about.
    pub name: String,
    /// The state, for people.
    pub message: String,
    /// The id of the component.
    pub hardware_id: String,
    /// Further values by name.
    pub values: Vec<(String, String)>,
}

/// The state of the bridge itself.
#[derive(Debug)]
pub struct BridgeState<'a> {
    /// The authority for control; `None` if it only reads.
    pub authority: Option<u8>,
    /// The state of control of the component that drives.
    pub drive: String,
    /// Why that control was last refused or lost; empty without a reason.
    pub obstacle: &'a str,
    /// The state of the last goal.
    pub goal: String,
    /// Counts.
    pub counters: &'a Counters,
}

/// A component whose last report is older than this is stale.
const STALE: Duration = Duration::from_secs(3);

/// What is wrong if ROS may drive a vehicle that cannot be driven.
pub(super) const NO_DRIVER: &str = "the vehicle has no driver that cmd_vel can use: no velocity state driver and no primitive driver";

/// The diagnostics of a vehicle and its bridge.
#[must_use]
pub fn diagnostics(now: Instant, vehicle: &Vehicle, bridge: &BridgeState<'_>) -> Vec<Diagnostic> {
    let parts = vehicle.parts().iter();
    let parts = parts.filter(|(_, part)| part.has(Role::Management));
    let mut all = vec![bridge.diagnostic(vehicle)];
    all.extend(parts.map(|(id, part)| of_part(now, *id, part)));
    all
}

fn of_part(now: Instant, id: JausId, part: &Part) -> Diagnostic {
    let (level, message) = match part.state(now, STALE) {
        None => (Level::Stale, "no report".to_owned()),
        Some(Ok(state)) => (level(state), state.to_string()),
        Some(Err(code)) => (Level::Warn, format!("unknown state {code}")),
    };
    let controller = match part.controller() {
        None => "unknown".to_owned(),
        Some(None) => "none".to_owned(),
        Some(Some((id, authority))) => format!("{id} with authority {authority}"),
    };
    let mut values = vec![("controller".to_owned(), controller)];
    if let Some(age) = part.age(now) {
        values.push(("age_s".to_owned(), format!("{:.2}", age.as_secs_f64())));
    }
    let name = match part.name.is_empty() {
        true => id.to_string(),
        false => format!("{id} {}", part.name),
    };
    Diagnostic {
        level,
        name,
        message,
        hardware_id: id.to_string(),
        values,
    }
}

const fn level(state: State) -> Level {
    match state {
        State::Ready | State::Standby => Level::Ok,
        State::Initialize | State::Shutdown => Level::Warn,
        State::Failure | State::Emergency => Level::Error,
    }
}

impl BridgeState<'_> {
    fn diagnostic(&self, vehicle: &Vehicle) -> Diagnostic {
        let is_known = !vehicle.parts().is_empty();
        let cannot_drive = self.authority.is_some() && vehicle.drive().is_none();
        let (level, message) = match self.obstacle {
            _ if !is_known => (Level::Error, "the vehicle is not known yet"),
            "" if cannot_drive => (Level::Warn, NO_DRIVER),
            "" => (Level::Ok, "connected"),
            obstacle => (Level::Warn, obstacle),
        };
        let authority = self.authority.map_or_else(
            || "none (--rights gives ROS rights)".to_owned(),
            |authority| authority.to_string(),
        );
        let mut values = vec![
            ("authority".to_owned(), authority),
            ("driver".to_owned(), driver(vehicle)),
            ("control".to_owned(), self.drive.clone()),
            ("goal".to_owned(), self.goal.clone()),
        ];
        let refused = [
            Counter::InvalidVelocity,
            Counter::OtherPublisher,
            Counter::Outdated,
            Counter::Locked,
            Counter::Forbidden,
            Counter::Unannounced,
            Counter::GoalRefused,
            Counter::EmergencyRefused,
            Counter::ClearRefused,
            Counter::Malformed,
            Counter::NotTaken,
        ];
        let counted = refused.into_iter().filter(|it| self.counters.get(*it) > 0);
        values.extend(counted.map(|it| (it.to_string(), self.counters.get(it).to_string())));
        Diagnostic {
            level,
            name: "jaus-ros2".to_owned(),
            message: message.to_owned(),
            hardware_id: String::new(),
            values,
        }
    }
}

fn driver(vehicle: &Vehicle) -> String {
    match vehicle.drive() {
        Some((id, Role::VelocityDriver)) => format!("{id}, a velocity state driver"),
        Some((id, _)) => format!("{id}, a primitive driver"),
        None => "none".to_owned(),
    }
}
