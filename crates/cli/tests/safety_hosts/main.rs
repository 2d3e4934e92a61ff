//! No motion without a living controller, on real hosts: `jaus vehicle` with its defaults in one
//! network namespace, its controller in another, and an observer that queries pose, velocity and
//! control ten times a second over its own cable.
//!
//! The tests print the rows of the table in docs/safety.md:
//! `cargo test --test safety_hosts -- --nocapture | grep '^|'`
//!
//! Namespaces need rights, see `jaus_test_kit::hosts`.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod roles;
mod testbed;
mod trial;

use roles::Drive;
use trial::{Fault, check, check_termination};

#[test]
fn effort_ends_when_the_controller_is_killed() {
    let test = "effort_ends_when_the_controller_is_killed";
    check(test, Drive::Effort, Fault::Killed);
}

#[test]
fn effort_ends_when_the_controller_is_suspended() {
    let test = "effort_ends_when_the_controller_is_suspended";
    check(test, Drive::Effort, Fault::Suspended);
}

#[test]
fn effort_ends_when_the_controller_is_cut_off() {
    let test = "effort_ends_when_the_controller_is_cut_off";
    check(test, Drive::Effort, Fault::CutAtController);
}

#[test]
fn effort_ends_when_the_link_of_the_vehicle_is_down() {
    let test = "effort_ends_when_the_link_of_the_vehicle_is_down";
    check(test, Drive::Effort, Fault::CutAtVehicle);
}

#[test]
fn effort_ends_when_the_controller_is_killed_among_many_dead_ids() {
    let test = "effort_ends_when_the_controller_is_killed_among_many_dead_ids";
    check(test, Drive::Effort, Fault::KilledAmongStrangers);
}

#[test]
fn effort_ends_when_the_controller_is_killed_behind_a_node() {
    let test = "effort_ends_when_the_controller_is_killed_behind_a_node";
    check(test, Drive::Effort, Fault::KilledBehindNode);
}

#[test]
fn effort_ends_when_the_node_of_the_controller_is_killed() {
    let test = "effort_ends_when_the_node_of_the_controller_is_killed";
    check(test, Drive::Effort, Fault::NodeKilled);
}

#[test]
fn a_vector_ends_when_the_controller_is_killed() {
    let test = "a_vector_ends_when_the_controller_is_killed";
    check(test, Drive::Vector, Fault::Killed);
}

#[test]
fn a_vector_ends_when_the_controller_is_suspended() {
    let test = "a_vector_ends_when_the_controller_is_suspended";
    check(test, Drive::Vector, Fault::Suspended);
}

#[test]
fn a_vector_ends_when_the_controller_is_suspended_behind_a_node() {
    let test = "a_vector_ends_when_the_controller_is_suspended_behind_a_node";
    check(test, Drive::Vector, Fault::SuspendedBehindNode);
}

#[test]
fn a_vector_ends_when_the_controller_is_cut_off() {
    let test = "a_vector_ends_when_the_controller_is_cut_off";
    check(test, Drive::Vector, Fault::CutAtController);
}

#[test]
fn a_vector_ends_when_the_controller_is_killed_among_many_dead_ids() {
    let test = "a_vector_ends_when_the_controller_is_killed_among_many_dead_ids";
    check(test, Drive::Vector, Fault::KilledAmongStrangers);
}

#[test]
fn a_waypoint_is_given_up_when_the_controller_is_killed() {
    let test = "a_waypoint_is_given_up_when_the_controller_is_killed";
    check(test, Drive::Waypoint, Fault::Killed);
}

#[test]
fn a_waypoint_is_given_up_when_the_controller_is_suspended() {
    let test = "a_waypoint_is_given_up_when_the_controller_is_suspended";
    check(test, Drive::Waypoint, Fault::Suspended);
}

#[test]
fn a_waypoint_is_given_up_when_the_link_of_the_vehicle_is_down() {
    let test = "a_waypoint_is_given_up_when_the_link_of_the_vehicle_is_down";
    check(test, Drive::Waypoint, Fault::CutAtVehicle);
}

#[test]
fn a_list_is_given_up_when_the_controller_is_killed_among_many_dead_ids() {
    let test = "a_list_is_given_up_when_the_controller_is_killed_among_many_dead_ids";
    check(test, Drive::List, Fault::KilledAmongStrangers);
}

#[test]
fn a_vehicle_that_is_terminated_stops_before_it_ends() {
    check_termination("a_vehicle_that_is_terminated_stops_before_it_ends");
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
