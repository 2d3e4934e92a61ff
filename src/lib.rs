//! A node stack for unmanned systems that speaks SAE JAUS on the wire: AS5669A transport, AS5710
//! core services, and services defined in JSIDL (AS5684).
//!
//! | you want to | look at |
//! |---|---|
//! | offer services, find and ask others | [`component`] |
//! | read and write messages | [`messages`], [`codec`] |
//! | run a node and see raw messages | [`node`] |
//! | embed the protocol where there is no tokio | [`endpoint`], [`service`] |
//! | look into datagrams | [`wire`]; the crate `jaus-view` for captures and JSON |
//! | know what other implementations do otherwise | [`peer`] |
//!
//! A vehicle with motion control, a world model and missions is the crate `jaus-vehicle`; systems of
//! the Reference Architecture 3.x are reached through `jaus-ra`; the tool `jaus` is `jaus-cli`.
//!
//! Modules know only those below them: `component`, then `service` and `node`, then `link`,
//! `endpoint`, `peer` and `messages`, then `wire` and `codec`, then `address`. `service` and
//! `endpoint`, and all below them, open no socket and read no clock.
#![forbid(unsafe_code)]

pub mod address;
mod as_text;
#[cfg(feature = "node")]
pub mod component;
mod counters;
pub mod endpoint;
#[cfg(feature = "node")]
pub mod link;
pub mod messages;
#[cfg(feature = "node")]
pub mod node;
pub mod peer;
pub mod service;
pub mod wire;

/// The runtime of the messages.
#[doc(inline)]
pub use jaus_codec as codec;

/// The README's programs compile.
#[cfg(all(doctest, feature = "node", feature = "mobility"))]
#[doc = include_str!("../README.md")]
struct Readme;

/// So do those of the guide to JSIDL.
#[cfg(doctest)]
#[doc = include_str!("../docs/jsidl.md")]
struct Jsidl;
