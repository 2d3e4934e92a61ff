//! The operator's station: a component that watches a vehicle, takes it under control, drives it and
//! stops it, and the page through which people do that in a browser.
//!
//! [`Station`] is the ready component. Its session speaks JAUS, its server speaks HTTP and WebSocket to
//! the pages; between them go requests one way and snapshots the other. Manual drive goes through the
//! [`Stick`](stick::Stick), which lets go of itself when nobody pushes it.
#![forbid(unsafe_code)]

mod answer;
mod missing;
pub(crate) mod page;
mod picture;
mod report;
pub mod request;
mod role;
mod sample_clock;
#[expect(
    clippy::disallowed_methods,
    reason = "the server's clock, tasks and pauses"
)]
mod server;
#[expect(
    clippy::disallowed_methods,
    reason = "the session's clock, tasks and pauses"
)]
mod session;
pub mod state;
mod station;
pub mod stick;
mod token;
mod tree;

pub use station::{Listen, OpenStation, Station};
pub use token::{Token, TokenError};

/// One connection of a page: who pushes the stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageId(pub u64);
