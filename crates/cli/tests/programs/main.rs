//! Programs as processes: the tool `jaus`, components, whole systems up to the
//! operator's page, and the package.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "tests with their own processes and sockets"
)]

#[cfg(target_os = "linux")]
mod dead_man;
#[cfg(target_os = "linux")]
mod e2e;
#[cfg(target_os = "linux")]
mod load;
#[cfg(target_os = "linux")]
mod logs;
#[cfg(target_os = "linux")]
mod metrics;
#[cfg(target_os = "linux")]
mod packaging;
#[cfg(target_os = "linux")]
mod parts;
#[cfg(target_os = "linux")]
mod program;
#[cfg(target_os = "linux")]
mod reference;
mod store;
mod support;
mod tool;
#[cfg(target_os = "linux")]
mod units;
#[cfg(target_os = "linux")]
mod up;
