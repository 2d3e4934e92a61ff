//! No motion without a living controller, on real hosts: `jaus vehicle` with its defaults in one
//! network namespace, its controller in another, and an observer that queries pose, velocity and
//! control ten times a second over its own cable.
//!
//! The tests print the rows of the table in docs/safety.md:
//! `cargo test --test namespaces safety -- --nocapture | grep '^|'`

mod roles;
mod trial;

use roles::Drive;
use trial::{Fault, check, check_termination};

#[test]
fn effort_ends_with_its_controller() {
    let faults = [
        Fault::Killed,
        Fault::Suspended,
        Fault::CutAtController,
        Fault::CutAtVehicle,
        Fault::KilledAmongStrangers,
        Fault::KilledBehindNode,
        Fault::NodeKilled,
    ];
    check(Drive::Effort, &faults);
}

#[test]
fn a_vector_ends_with_its_controller() {
    let faults = [
        Fault::Killed,
        Fault::Suspended,
        Fault::SuspendedBehindNode,
        Fault::CutAtController,
        Fault::KilledAmongStrangers,
    ];
    check(Drive::Vector, &faults);
}

#[test]
fn a_waypoint_is_given_up_with_its_controller() {
    let faults = [Fault::Killed, Fault::Suspended, Fault::CutAtVehicle];
    check(Drive::Waypoint, &faults);
}

#[test]
fn a_list_is_given_up_with_its_controller() {
    check(Drive::List, &[Fault::KilledAmongStrangers]);
}

#[test]
fn a_vehicle_that_is_terminated_stops_before_it_ends() {
    check_termination();
}

/// Not a test by itself: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "controller" => roles::control().await,
        "observer" => roles::observe().await,
        "strangers" => roles::show_up().await,
        other => panic!("unknown role {other}"),
    });
}
