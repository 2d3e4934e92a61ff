//! Speaking the Reference Architecture 3.2 and 3.3, JAUS as it was before the SAE standards, without
//! I/O and without a clock.
//!
//! | part | what it knows |
//! |---|---|
//! | [`Message`] | one whole message, whichever framing carried it |
//! | [`carrier`] | datagrams: the framings "JAUS01.0" and AS5669, addresses, large messages |
//! | [`node`] | our presence among RA systems: heartbeats, identification, configuration, services |
//! | [`connection`] | service connections, as the one who reports and as the one who is reported to |
//! | `convert` | which RA message stands for which of ours, and what cannot be said |
//! | [`ids`] | which RA id stands for which of ours |
//!
//! Ids have four octets here, [`RaId`]: subsystem, node, component and instance, where the number of
//! a component names its type. The subsystem speaks through its *communicator* (component 35),
//! each node through its *node manager* (component 1).
#![forbid(unsafe_code)]

pub mod carrier;
pub mod connection;
pub mod convert;
mod counters;
mod forgiving;
pub mod gateway;
pub mod ids;
mod message;
pub mod messages;
pub mod node;

pub use counters::{Counter, Counters};
pub use jaus::wire::ra::{BadId, InvalidRaId, RaId, Recipients};
pub use message::Message;
