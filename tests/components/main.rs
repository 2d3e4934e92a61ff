//! Components in an application: discovery, queries, subscriptions, control, groups, and other
//! stacks as peers.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod client;
mod discovery;
mod examples;
mod groups;
mod offering;
mod peers;
mod requests;
mod servers;
#[path = "../support/streams.rs"]
mod streams;
mod superseded;
mod undecoded;
