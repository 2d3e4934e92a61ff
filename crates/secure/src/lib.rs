//! Authenticated, encrypted links between the nodes of a JAUS system.
//!
//! JAUS has no authentication: any host that can send to a vehicle can drive it. AS5669 does
//! not allow the payload to change, so this crate leaves the messages as they are and carries their
//! JUDP datagrams through QUIC: TLS 1.3, congestion control, and connections that survive a change
//! of address.
//!
//! * Each node has an Ed25519 key ([`Key`]), kept in a file.
//! * A [`TrustFile`] lists the public keys of the other nodes, and the JAUS ids that each may speak
//!   for. A node without an entry cannot complete the handshake. A message from an id that its
//!   sender's key may not speak for is refused and counted.
//! * Instead, a node may have a [`Certificate`] of its team's [`Authority`], which names it and
//!   holds its ids; see [`Credentials`].
//! * [`SecureLink`] is the link. It listens on a UDP port of its own and dials the configured peers;
//!   one side has to be reachable. With [beacons](beacon), nodes of one network find each other. The peers are two nodes of this crate: other JAUS
//!   implementations have no counterpart.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use jaus::node::{Config, Node};
//! use jaus_secure::{Key, SecureLink, Settings, TrustFile};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let key = Key::load(Path::new("node.key"))?;
//! let trust = TrustFile::load(Path::new("trusted_keys"))?;
//! let settings = Settings::new("0.0.0.0:3795".parse()?).connect("192.168.7.2:3795".parse()?);
//! let link = SecureLink::open(&key, trust, settings)?;
//!
//! // No interfaces: the node has this link alone, and refuses plain JUDP.
//! let node = Node::start_with(Config::new(60, 1).without_udp(), vec![Box::new(link)])?;
//! # Ok(())
//! # }
//! ```
//!
//! The protocol logic ([`transport`]) does no I/O and reads no clock; [`SecureLink`] adds the socket.
#![forbid(unsafe_code)]

mod approval;
mod authority;
pub mod beacon;
#[cfg(feature = "ca")]
pub mod ca;
mod certificate;
mod credentials;
mod crypto;
pub mod edit;
mod follow;
mod key;
mod link;
mod tls;
pub mod transport;
mod trust;

pub use approval::{ApprovalError, DualControl, Proposal};
pub use authority::{Authority, Rejection};
pub use certificate::{Certificate, CertificateError, Defect};
pub use credentials::{CertificateFiles, Credentials, CredentialsError};
pub use crypto::crypto_library;
#[cfg(feature = "ca")]
pub use key::Passphrase;
pub use key::{Fingerprint, Key, KeyError, PublicKey};
pub use link::{Announce, OpenError, Reached, SecureLink, Settings};
pub use trust::{Grant, Peer, Trust, TrustError, TrustFile};
