//! Places in order, across: lists of ours and the numbered waypoints and path segments of RA drivers.
//!
//! Ours are elements that name their neighbours, and the list is executed from one of them on. RA
//! drivers know places by number, from 0 on, and set out when they are given a speed of travel; they
//! forget none, and tell neither which one they are driving to nor whether they took one.
//!
//! | here | what it does |
//! |---|---|
//! | [`Course`] | keeps the list that JAUS clients set for an RA driver, and gives it the driver when it is executed |
//! | [`Entries`] | makes elements of a JAUS driver's list of the places that an RA client sets |
//!
//! Both are told the time and say what is to be sent.

mod entries;
mod handover;
mod list;
#[cfg(test)]
mod tests;

pub(super) use entries::{Entries, Want};
pub(super) use list::{Course, Refused};
