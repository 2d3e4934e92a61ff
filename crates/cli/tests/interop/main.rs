//! Interoperability suite: a subject and its peers, each on a host of its own, in the same
//! scenarios. It depends only on the network traffic and the parties' settings; the result is a
//! table in `target/interop`. `README.md` beside this file explains how to add a peer.
//!
//! Hosts need rights, see `jaus_test_kit::hosts`. Without them the suite prints `NOT TESTED`.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

#[cfg(target_os = "linux")]
mod suite;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    suite::main()
}

#[cfg(not(target_os = "linux"))]
fn main() {
    let reason = "it needs the network namespaces of Linux";
    jaus_test_kit::evidence::not_tested("interop", reason);
}
