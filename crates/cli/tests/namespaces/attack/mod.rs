//! Attacks on `jaus vehicle`, on real hosts: the vehicle with its defaults in one network
//! namespace, an attacker in another, and well-behaved clients in two more.
//!
//! The tests print the rows of the table in docs/safety.md:
//! `cargo test --test namespaces attack -- --nocapture | grep '^|'`
//!
//! Every attack is bounded in time and in packets.

mod attacker;
mod attacks;
mod bed;
mod clients;
mod connections;
mod floods;
mod forgeries;
mod gateway;
mod ip6;
mod routers;
mod scene;
#[cfg(feature = "secure")]
mod secure;
mod soak;
mod streams;
mod talkers;

use crate::gateway::{operator, ra_vehicle};
use crate::testbed::Host;

/// Not a test by itself: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "client" => clients::client().await,
        "newcomer" => clients::newcomer().await,
        "subscriber" => clients::subscriber().await,
        "echo" => clients::echo(),
        "talker" => talkers::talk().await,
        "connections" => connections::run().await,
        "ra-vehicle" => ra_vehicle::play(Host::Controller.cable()).await,
        "operator" => operator::play().await,
        attack => attacks::run(attack).await,
    });
}
