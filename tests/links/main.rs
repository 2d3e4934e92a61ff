//! Links and framings: UDP, TCP, serial lines, the local link, Junior's node manager.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod attack_serial;
mod flood_udp;
mod forwarding;
mod jserial;
mod jserial_captures;
mod jtcp;
mod jtcp_captures;
mod jtcp_link;
mod junior_host;
mod local;
#[path = "../support/streams.rs"]
mod streams;
mod udp;
mod udp_large;
mod udp_node;
