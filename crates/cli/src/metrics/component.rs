//! The metrics of a program's component, and of the vehicle that it is a part of.

use std::time::Instant;

use jaus::component::{Component, State};
use jaus_vehicle::parts::{MissionCounts, Readout};

use super::exposition::{Exposition, Unit};

const STATES: [State; 6] = [
    State::Initialize,
    State::Ready,
    State::Standby,
    State::Shutdown,
    State::Failure,
    State::Emergency,
];

/// Maximum number of services with samples of their own.
const MOST: usize = 64;

/// Adds what a part shows; `emergencies` is how often its component has entered that state.
pub(super) fn add(exposition: &mut Exposition, readout: &Readout, emergencies: u64, now: Instant) {
    if let Some(component) = &readout.component {
        add_component(exposition, component, emergencies);
    }
    let help = "Forward velocity of the vehicle; negative in reverse.";
    let mut speed = exposition.gauge("jaus_vehicle_speed", Unit::MetersPerSecond, help);
    if let Some(value) = readout.speed {
        speed.add(&[], value);
    }
    let help = "Age of the newest sample of a sensor value.";
    let mut ages = exposition.gauge("jaus_sample_age", Unit::Seconds, help);
    for (value, &at) in &readout.samples {
        let age = now.saturating_duration_since(at).as_secs_f64();
        ages.add(&[("value", value)], age);
    }
    add_missions(exposition, readout.missions);
}

fn add_component(exposition: &mut Exposition, component: &Component, emergencies: u64) {
    let id = component.id();
    let directory = component.directory();
    let help = "Components that discovery has found, including this one.";
    exposition
        .gauge("jaus_known_components", Unit::None, help)
        .add(&[("component", &id)], directory.len());
    let help = "A service that the component offers, and its version.";
    let mut services = exposition.gauge("jaus_service_info", Unit::None, help);
    let own = directory.component(id);
    for offer in own.iter().flat_map(|own| own.offered()).take(MOST) {
        let version = format!("{}.{}", offer.major, offer.minor);
        let labels: [(&str, &dyn std::fmt::Display); 3] = [
            ("component", &id),
            ("service", &offer.urn),
            ("version", &version),
        ];
        services.add(&labels, 1_u64);
    }
    let standing = component.standing();
    let help = "State of the component: 1 for the one that it is in, 0 for the others.";
    let mut states = exposition.gauge("jaus_component_state", Unit::None, help);
    for state in STATES {
        let labels: [(&str, &dyn std::fmt::Display); 2] = [("component", &id), ("state", &state)];
        states.add(&labels, state == standing.state);
    }
    let help = "How often the component has entered the state emergency.";
    exposition
        .counter("jaus_component_emergencies", Unit::None, help)
        .add(&[("component", &id)], emergencies);
    let help = "Setpoints that were refused because their senders had superseded them.";
    exposition
        .counter("jaus_component_refused_setpoints", Unit::None, help)
        .add(&[("component", &id)], component.refused_setpoints());
    let help = "Whether a client is in control of the component (1) or none (0).";
    let mut controlled = exposition.gauge("jaus_component_controlled", Unit::None, help);
    if standing.exclusive {
        controlled.add(&[("component", &id)], standing.controller.is_some());
    }
    let help = "Authority of the client in control, 0 to 255.";
    let mut authority = exposition.gauge("jaus_component_control_authority", Unit::None, help);
    if let Some(controller) = standing.controller {
        authority.add(&[("component", &id)], u64::from(controller.authority));
    }
}

fn add_missions(exposition: &mut Exposition, missions: Option<MissionCounts>) {
    let help = "Missions of the planner that have ended, by result.";
    let mut ended = exposition.counter("jaus_missions", Unit::None, help);
    if let Some(missions) = missions {
        ended.add(&[("result", &"arrived")], missions.arrived);
        ended.add(&[("result", &"failed")], missions.failed);
        ended.add(&[("result", &"stopped")], missions.stopped);
    }
    let help = "Whether a mission is in progress (1) or not (0).";
    let mut under_way = exposition.gauge("jaus_mission_under_way", Unit::None, help);
    if let Some(missions) = missions {
        under_way.add(&[], missions.stage.is_under_way());
    }
}
