//! Programs in C and C++ over the interface, compiled by gcc and g++, against each other and against
//! components in Rust and Python.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod compiler;
mod mixes;
mod parts;
mod readme;
mod safety;
mod scene;
