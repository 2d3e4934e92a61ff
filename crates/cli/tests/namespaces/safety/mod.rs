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
fn effort_ends_when_the_controller_is_killed() {
    check(Drive::Effort, Fault::Killed);
}

#[test]
fn effort_ends_when_the_controller_is_suspended() {
    check(Drive::Effort, Fault::Suspended);
}

#[test]
fn effort_ends_when_the_controller_is_cut_off() {
    check(Drive::Effort, Fault::CutAtController);
}

#[test]
fn effort_ends_when_the_link_of_the_vehicle_is_down() {
    check(Drive::Effort, Fault::CutAtVehicle);
}

#[test]
fn effort_ends_when_the_controller_is_killed_among_many_dead_ids() {
    check(Drive::Effort, Fault::KilledAmongStrangers);
}

#[test]
fn effort_ends_when_the_controller_is_killed_behind_a_node() {
    check(Drive::Effort, Fault::KilledBehindNode);
}

#[test]
fn effort_ends_when_the_node_of_the_controller_is_killed() {
    check(Drive::Effort, Fault::NodeKilled);
}

#[test]
fn a_vector_ends_when_the_controller_is_killed() {
    check(Drive::Vector, Fault::Killed);
}

#[test]
fn a_vector_ends_when_the_controller_is_suspended() {
    check(Drive::Vector, Fault::Suspended);
}

#[test]
fn a_vector_ends_when_the_controller_is_suspended_behind_a_node() {
    check(Drive::Vector, Fault::SuspendedBehindNode);
}

#[test]
fn a_vector_ends_when_the_controller_is_cut_off() {
    check(Drive::Vector, Fault::CutAtController);
}

#[test]
fn a_vector_ends_when_the_controller_is_killed_among_many_dead_ids() {
    check(Drive::Vector, Fault::KilledAmongStrangers);
}

#[test]
fn a_waypoint_is_given_up_when_the_controller_is_killed() {
    check(Drive::Waypoint, Fault::Killed);
}

#[test]
fn a_waypoint_is_given_up_when_the_controller_is_suspended() {
    check(Drive::Waypoint, Fault::Suspended);
}

#[test]
fn a_waypoint_is_given_up_when_the_link_of_the_vehicle_is_down() {
    check(Drive::Waypoint, Fault::CutAtVehicle);
}

#[test]
fn a_list_is_given_up_when_the_controller_is_killed_among_many_dead_ids() {
    check(Drive::List, Fault::KilledAmongStrangers);
}

#[test]
fn a_vehicle_that_is_terminated_stops_before_it_ends() {
    check_termination();
}

/// Not a test of its own: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "controller" => roles::control().await,
        "observer" => roles::observe().await,
        "strangers" => roles::show_up().await,
        other => panic!("unknown role {other}"),
    });
}
