//! Large messages: fragmentation when sending, reassembly when receiving.
//!
//! Each fragment is a message of its own with the next sequence number and the data control first,
//! middle or last. In AS5669A only the first fragment begins with the message code (as in Junior).
//! The older headers name the code with each fragment, and JAUS++ repeats it in the payload of
//! each.

mod reassembly;
mod split;
mod style;

pub(super) use reassembly::{Reassembly, Whole};
pub(super) use split::{Cut, Cutting, Numbers};
