//! A node stack for unmanned systems that speaks SAE JAUS on the wire: AS5669A transport, AS5710
//! core services, and services defined in JSIDL (AS5684).
//!
//! | you want to | look at |
//! |---|---|
//! | offer services, find and ask others | [`component`] |
//! | read and write messages | [`messages`], [`codec`] |
//! | run a node and see raw messages | [`node`] |
//! | embed the protocol where there is no tokio | [`endpoint`], [`service`] |
//! | look into datagrams | [`wire`], and [`view`] for captures and JSON |
//! | know what other implementations do otherwise | [`peer`] |
//!
//! Modules know only those below them: `view` and `component`, then `service` and `node`, then
//! `link`, `endpoint`, `peer` and `messages`, then `wire` and `codec`, then `address`. From
//! `service` and `endpoint` downwards nothing opens a socket or reads a clock.
#![forbid(unsafe_code)]

pub mod address;
mod as_text;
pub mod codec;
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

/// The README's programs compile.
#[cfg(all(doctest, feature = "node", feature = "mobility"))]
#[doc = include_str!("../README.md")]
struct Readme;

/// So do those of the guide to JSIDL.
#[cfg(doctest)]
#[doc = include_str!("../docs/jsidl.md")]
struct Jsidl;
