//! Recordings and the live server from outside, with captures of other stacks and hostile input.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    clippy::disallowed_types,
    unreachable_pub,
    reason = "these are tests"
)]

mod damage;
mod hostile;
mod live;
mod recordings;
mod samples;
mod scene;
