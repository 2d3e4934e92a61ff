//! Large messages: cut into fragments when sent, put together when received.
//!
//! A fragment is a message of its own with the next sequence number and the data control first,
//! middle or last. With AS5669A the message code stands only at the beginning of the first (Junior
//! does the same); the older headers name it with each fragment, and JAUS++ repeats it in the
//! payload of each.

mod reassembly;
mod split;
mod style;

pub(super) use reassembly::{Reassembly, Whole};
pub(super) use split::{Cut, Cutting, Numbers};
