//! Reference Architecture 3.2 and 3.3, the JAUS version before the SAE standards, without I/O and
//! without a clock.
//!
//! | part | content |
//! |---|---|
//! | [`Message`] | one complete message, independent of the framing |
//! | [`carrier`] | datagrams: the framings "JAUS01.0" and AS5669, addresses, large messages |
//! | [`node`] | our presence among RA systems: heartbeats, names, configuration, services |
//! | [`connection`] | service connections, as provider and as client |
//! | `convert` | conversion between RA messages and ours |
//! | [`ids`] | mapping between RA ids and ours |
//!
//! RA ids have four octets, [`RaId`]: subsystem, node, component and instance; the component number
//! names the component type. A subsystem is represented by its *communicator* (component 35), each
//! node by its *node manager* (component 1).
#![forbid(unsafe_code)]

pub mod carrier;
pub mod connection;
pub mod convert;
mod counters;
pub mod forgiving;
pub mod gateway;
pub mod ids;
mod message;
pub mod messages;
pub mod node;

pub use counters::{Counter, Counters};
pub use jaus::wire::ra::{BadId, InvalidRaId, RaId, Recipients};
pub use message::Message;
