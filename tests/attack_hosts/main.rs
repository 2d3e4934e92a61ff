//! Attacks on `jaus vehicle`, on real hosts: the vehicle with its defaults in one network namespace,
//! an attacker in another, and clients that behave in two more.
//!
//! The rows of the table in docs/safety.md are printed:
//! `cargo test --test attack_hosts -- --nocapture | grep '^|'`
//!
//! Every attack is bounded in time and in packets. Making namespaces needs rights, see
//! `tests/namespaces`.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod attacker;
mod attacks;
mod bed;
mod clients;
mod connections;
mod floods;
mod forgeries;
mod gateway;
#[path = "../namespaces/hosts.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod hosts;
mod ip6;
#[path = "../support/networks.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod networks;
#[path = "../gateway_hosts/operator.rs"]
mod operator;
#[path = "../gateway_hosts/ra_vehicle.rs"]
mod ra_vehicle;
mod routers;
#[path = "../gateway/rover.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod rover;
mod scene;
mod soak;
mod streams;
mod talkers;
#[path = "../safety_hosts/testbed.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod testbed;
#[path = "../support/vehicle_process.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod vehicle_process;

/// Not a test of its own: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    hosts::play(async |role| match role {
        "client" => clients::client().await,
        "newcomer" => clients::newcomer().await,
        "subscriber" => clients::subscriber().await,
        "echo" => clients::echo(),
        "talker" => talkers::talk().await,
        "connections" => connections::run().await,
        "ra-vehicle" => ra_vehicle::play(testbed::Host::Controller.cable()).await,
        "operator" => operator::play().await,
        attack => attacks::run(attack).await,
    });
}
