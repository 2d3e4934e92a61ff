//! Tests of the language: loading and checking definitions, behaviour, documentation, the dynamic
//! codec, and all generated output.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on fails"
)]

mod behaviour;
mod clients;
mod corpus;
mod diagnostics;
mod diff;
mod docs;
mod dynamic;
mod emitted;
mod excerpts;
mod explain;
mod foreign;
mod format;
mod golden;
mod grammar;
mod loading;
mod lua;
mod machines;
mod permissions;
mod ros;
mod round_trips;
mod schema;
mod services;
mod support;
mod validator_cases;
