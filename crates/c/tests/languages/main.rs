//! Programs in C and C++ over the interface: compiled by the system's compilers, against each other and
//! against components in Rust. The compilers are gcc and g++.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod compiler;
mod safety;
mod scene;
mod system;
