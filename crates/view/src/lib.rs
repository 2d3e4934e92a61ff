//! Human-readable views of JAUS traffic: captures, and JSON of any message.
//!
//! From the outside in: a [`Capture`] yields [`Frame`]s, a [`Network`] extracts their UDP
//! [`Datagram`]s, a [`MessageLog`] the JAUS messages in those, and a [`Dictionary`] the fields of a
//! message. A [`Line`] is the result as one JSON object; a [`Request`] is the reverse. The stack
//! does not depend on this crate.
#![forbid(unsafe_code)]

mod capture;
#[cfg(feature = "web")]
pub mod debug;
mod definition;
mod dictionary;
mod hex;
mod journal;
pub mod junit;
mod large;
mod line;
mod log;
mod named;
mod network;
mod query;
mod request;
mod stream;
mod time;
pub mod tree;
mod units;
mod words;

pub use capture::{Capture, CaptureError, CaptureWriter, Frame, InterfaceNumber, LinkType};
pub use definition::{Body, Decode, ServiceName, Unreadable};
pub use dictionary::{Added, Dictionary, Reading};
pub use hex::{from_hex, to_hex};
pub use journal::{
    Journal, JournalCounters, JournalError, JournalFormat, JournalSettings, LEAST_FILE,
};
pub use line::{Content, Envelope, Header, Line};
pub use log::MessageLog;
pub use network::{Counts, Datagram, JAUS_PORT, Network, udp_packet};
pub use query::{EncodedQuery, is_part_of_name, is_same_name};
pub use request::Request;
pub use stream::Links;
pub use stream::{Entry, Filter, FilterError, MessageStream};
pub use time::{InvalidTime, Timestamp};
pub use words::{FieldText, symbol};
