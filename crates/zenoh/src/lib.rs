//! A bridge between JAUS systems over a zenoh network.
//!
//! To its JAUS node the bridge is a link like the others: a [`ZenohLink`] carries JUDP datagrams
//! with one message each, and every bridge on the other side is a session of it. Discovery, events,
//! control and the detection of dead peers therefore work as over any other link, from end to end.
//!
//! * [`key`]: the key expressions of messages, presence and views.
//! * [`Exchange`]: which messages pass, which bridge speaks for which id, and what to publish. It does
//!   no I/O and reads no clock.
//! * [`ZenohLink`]: the exchange as a link of a node.
//! * [`Bridge`]: the component that runs it, with a zenoh session and the JSON view.
//!
//! `docs/zenoh.md` is the guide to the program.
#![forbid(unsafe_code)]

mod arrivals;
mod bridge;
mod counters;
mod exchange;
pub mod key;
mod link;
mod network;
mod notices;
mod proof;
mod queue;
mod remotes;
mod thin;
mod view;

pub use bridge::Bridge;
pub use counters::{Counter, Counters};
pub use exchange::{Exchange, Settings};
pub use link::ZenohLink;
pub use network::{NetworkError, NetworkSettings, open_session};
pub use proof::check as check_proof;
pub use queue::{Command, Publication};
pub use thin::{MinPeriod, MinPeriodError};
