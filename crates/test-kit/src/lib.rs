//! Shared parts of the workspace's tests: evidence, hosts in network namespaces, processes, peers,
//! bounded waiting.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::expect_used,
    clippy::missing_panics_doc,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

pub mod evidence;
pub mod example;
pub mod figures;
pub mod group;
#[cfg(target_os = "linux")]
pub mod hosts;
pub mod map_file;
pub mod program;
pub mod random;
pub mod rover;
pub mod snapshot;
pub mod tools;
pub mod vehicle_process;
pub mod waiting;
