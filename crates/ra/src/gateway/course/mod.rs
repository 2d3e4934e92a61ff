//! Ordered places across the gateway: JAUS lists and the numbered places of RA drivers.
//!
//! A JAUS list consists of elements that name their neighbours, and is executed from one of them.
//! RA drivers know places by number, from 0, and start when they get a travel speed; they keep
//! every place, and report neither their current target nor whether they accepted a place.
//!
//! | type | purpose |
//! |---|---|
//! | [`Course`] | keeps the list that JAUS clients set for an RA driver, and sends it on execution |
//! | [`Entries`] | turns the places that an RA client sets into list elements of a JAUS driver |
//!
//! Both take the time as an argument and return the messages to send.

mod entries;
mod handover;
mod list;
#[cfg(test)]
mod tests;

pub(super) use entries::{Entries, Want};
pub(super) use list::{Course, Refused};
