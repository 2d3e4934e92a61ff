//! What the decoder tells while it reads: which octets became which field.
//!
//! The plain way is traced by `()`, which hears nothing; the compiler leaves no trace of it.

use std::ops::Range;

use super::Raw;
use crate::model::{
    BitField, Choice, Count, Format, Group, Item, Message, Scalar, Unsigned, Variant,
};

/// Hears what a decoder reads, in the order of the octets.
///
/// Only what was found to be right is told. After a mistake nothing follows, so that not every
/// [`enter`](Self::enter) has its [`leave`](Self::leave).
pub(crate) trait Trace<'m> {
    /// Octets were read; none for an empty string, say.
    fn read(&mut self, octets: Range<usize>, part: Part<'m>);

    /// An optional member is not there.
    fn absent(&mut self, member: &'m Item);

    /// What follows belongs to a member, until [`leave`](Self::leave).
    fn enter(&mut self, place: Place<'m>);

    /// The member ends.
    fn leave(&mut self);
}

impl Trace<'_> for () {
    fn read(&mut self, _: Range<usize>, _: Part<'_>) {}
    fn absent(&mut self, _: &Item) {}
    fn enter(&mut self, _: Place<'_>) {}
    fn leave(&mut self) {}
}

/// Where a step leads to.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Place<'m> {
    /// A member of a group, or the chosen alternative of a variant.
    Member(&'m Item),
    /// An element of a list or array, counted from 0 in the order of the wire.
    Element(usize),
}

/// What a run of octets is.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Part<'m> {
    /// The message code.
    Code(&'m Message),
    /// A presence vector.
    Presence(&'m Group, Unsigned, u64),
    /// A count of elements or octets.
    Count(&'m Count, u64),
    /// The tag of a variant.
    Tag(&'m Variant, u64),
    /// The index of a `variable_format_field`.
    Format(&'m [Format], u8),
    /// The index of a `variable_field`, and what it chose.
    Index(&'m Choice),
    /// A number.
    Number(&'m Scalar, Raw),
    /// The integer of a bit field.
    Bits(&'m BitField, u64),
    /// A string, with the zeros that pad it.
    Text,
    /// Octets of a declared format, for example `JAUS MESSAGE`; empty if the format is not known.
    Octets(&'m str),
}
