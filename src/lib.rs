//! A node stack for unmanned systems that implements SAE JAUS: the AS5669A transport, the AS5710
//! core services, and services defined in JSIDL (AS5684).
//!
//! | task | see |
//! |---|---|
//! | offer services, find and query components | [`component`] |
//! | read and write messages | [`messages`], [`codec`] |
//! | run a node and see raw messages | [`node`] |
//! | embed the protocol where there is no tokio | [`endpoint`], [`service`] |
//! | decide what a sender may do | [`rights`] |
//! | inspect datagrams | [`wire`]; the crate `jaus-view` for captures and JSON |
//! | look up the differences of other implementations | [`peer`] |
//!
//! The crate `jaus-vehicle` adds motion control, a world model and missions. `jaus-ra` reaches
//! systems of the Reference Architecture 3.x. The command line tool `jaus` is `jaus-cli`.
//!
//! Modules depend only on those below them: `component`, then `service` and `node`, then `link`,
//! `endpoint`, `rights`, `peer` and `messages`, then `wire` and `codec`, then `address`. `service` and
//! `endpoint`, and all modules below them, open no socket and read no clock.
#![forbid(unsafe_code)]
// Without a node, links to what needs one lead nowhere; with it they are checked.
#![cfg_attr(not(feature = "node"), allow(rustdoc::broken_intra_doc_links))]

pub mod address;
mod as_text;
#[cfg(feature = "node")]
pub mod component;
pub mod counters;
pub mod endpoint;
#[cfg(feature = "node")]
pub mod link;
pub mod messages;
#[cfg(feature = "node")]
pub mod node;
pub mod peer;
#[doc(hidden)]
pub mod random;
pub mod rights;
pub mod service;
pub mod wire;

/// The runtime of the messages.
#[doc(inline)]
pub use jaus_codec as codec;

/// Compiles the programs of the README and of the guides.
#[cfg(all(doctest, feature = "node", feature = "mobility"))]
mod texts {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/safety.md")]
    struct Safety;
    #[doc = include_str!("../docs/sessions.md")]
    struct Sessions;
    #[doc = include_str!("../docs/tutorial.md")]
    struct Tutorial;
}

/// Compiles the programs in the guide to JSIDL.
#[cfg(doctest)]
#[doc = include_str!("../docs/jsidl.md")]
struct Jsidl;
