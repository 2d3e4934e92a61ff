//! The operator control unit (OCU): a component that monitors, controls, drives and stops a
//! vehicle, and its browser page.
//!
//! [`Station`] is the complete component. Its session speaks JAUS; its server speaks HTTP and
//! WebSocket to the pages. Requests pass from server to session, snapshots in the other direction.
//! Manual drive goes through the [`Stick`](stick::Stick), which releases itself when pushes cease.
#![forbid(unsafe_code)]

mod answer;
mod base_map;
mod changes;
mod events;
#[expect(clippy::disallowed_methods, reason = "the subscriptions' delays")]
mod following;
mod georeference;
mod handover;
mod map_overlay;
mod missing;
mod orders;
pub mod ownership;
pub(crate) mod page;
pub mod page_link;
mod pages;
mod picture;
mod press;
mod report;
pub mod request;
mod role;
#[expect(
    clippy::disallowed_methods,
    reason = "the server's clock, tasks and delays"
)]
mod server;
#[expect(
    clippy::disallowed_methods,
    reason = "the session's clock, tasks and delays"
)]
mod session;
pub mod state;
mod station;
pub mod stick;
mod stop_monitor;
mod tls;
mod token;
mod tree;
pub mod users;
mod vehicle_link;

pub use base_map::{BaseMap, BaseMapError};
pub use station::{Listen, OpenStation, Station};
pub use tls::Tls;
#[cfg(feature = "https")]
pub use tls::TlsError;
pub use token::{Token, TokenError};
