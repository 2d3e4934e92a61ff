//! Nodes and programs as processes on several hosts: network namespaces with cables between them.
//! Test nodes are this test binary, started again inside a namespace.
//!
//! Namespaces need rights: root's, or a kernel that permits user namespaces. Without either, the
//! tests report this prominently and pass.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests with processes"
)]

mod attack;
mod doctor;
mod gateway;
mod judge;
mod nodes;
mod safety;
mod secure;
mod testbed;
