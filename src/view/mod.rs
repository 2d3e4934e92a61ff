//! What people look at: captures, and JSON of any message.
//!
//! From the outside in: a [`Capture`] gives frames, a [`Network`] finds the UDP datagrams in them.
//! Nothing below this module knows that it exists.

mod capture;
mod network;
mod time;

pub use capture::{Capture, CaptureError, Frame, LinkType};
pub use network::{Counts, Datagram, JAUS_PORT, Network};
pub use time::Timestamp;
