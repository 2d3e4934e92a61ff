//! Traces the decoder: which octets became which field.
//!
//! `()` is the tracer that ignores everything; the compiler removes it.

use std::ops::Range;

use super::Raw;
use crate::model::{
    BitField, Choice, Count, Format, Group, Item, Message, Scalar, Unsigned, Variant,
};

/// Receives the decoded parts, in the order of the octets.
///
/// Only valid parts are traced. After an error nothing follows, so an [`enter`](Self::enter) may
/// lack its [`leave`](Self::leave).
pub(crate) trait Trace<'m> {
    /// Octets were read; possibly none, for example of an empty string.
    fn read(&mut self, octets: Range<usize>, part: Part<'m>);

    /// An optional member is absent.
    fn absent(&mut self, member: &'m Item);

    /// The following parts belong to a member, until [`leave`](Self::leave).
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

/// Target of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Place<'m> {
    /// A member of a group, or the selected alternative of a variant.
    Member(&'m Item),
    /// An element of a list or array, counted from 0 in the order of the wire.
    Element(usize),
}

/// Kind of an octet run.
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
    /// The index of a `variable_field`, and the selected choice.
    Index(&'m Choice),
    /// A number.
    Number(&'m Scalar, Raw),
    /// The integer of a bit field.
    Bits(&'m BitField, u64),
    /// A string, including its padding zeros.
    Text,
    /// Octets of a declared format, for example `JAUS MESSAGE`; empty if the format is unknown.
    Octets(&'m str),
}
