//! Programs as processes: components, whole systems, `jaus-tester load`, and the package.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "tests with their own processes and sockets"
)]

#[cfg(target_os = "linux")]
mod load;
#[cfg(target_os = "linux")]
mod packaging;
#[cfg(target_os = "linux")]
mod parts;
mod store;
#[path = "../support/mod.rs"]
mod support;
#[cfg(target_os = "linux")]
mod up;
