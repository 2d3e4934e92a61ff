//! Runtime library for the messages that the crate `jsidl` generates.
//!
//! A JAUS message is its code followed by its body, little-endian, unaligned and unpadded.
//! Generated code is plain Rust over the types of this crate: a [`Reader`] over shared octets, an
//! appending [`Writer`], [`Fixed`] for values of constant size, [`Composite`] for values of
//! variable size, and public field types: [`Scale`]d integers, enumerations, bit fields, [`Text`].
//!
//! Every generated type guarantees:
//! - Values are stored as the integers on the wire, so `encode(decode(b)) == b` for every accepted
//!   `b`.
//! - Decoding never panics and never allocates more than the input can fill.
//! - Errors name the message, the path to the field and the octet offset.
//!
//! The crate needs no operating system, only an allocator: it is `no_std`, and so is generated code.
//! The feature `arbitrary`, which is for tests, needs the standard library.
#![no_std]
#![forbid(unsafe_code)]

extern crate alloc;
#[cfg(test)]
extern crate std;

#[cfg(feature = "arbitrary")]
pub mod arbitrary;
#[doc(hidden)]
pub mod bits;
mod blob;
mod calendar;
mod composite;
mod enumeration;
mod error;
mod exact;
mod fixed;
mod large_array;
pub mod machine;
mod members;
mod message;
mod query;
mod reader;
mod registry;
mod scale;
mod service;
mod text;
#[cfg(feature = "serde")]
pub mod view;
mod writer;

#[doc(no_inline)]
pub use bytes::Bytes;

pub use bits::Bits;
pub use blob::FormattedBlob;
pub use calendar::{Date, time_stamp};
pub use composite::Composite;
pub use enumeration::Enumeration;
pub use error::{DecodeError, DecodeErrorKind, EncodeError, EncodeErrorKind};
pub use fixed::{Count, Fixed};
pub use large_array::LargeArray;
#[cfg(not(feature = "serde"))]
#[doc(hidden)]
pub use message::View;
pub use message::{AnyMessage, Message, ServiceId};
#[doc(hidden)]
pub use query::keep_if;
pub use query::{Echo, Query, Report, query_code, report_code};
pub use reader::Reader;
#[doc(hidden)]
pub use registry::RandomMessage;
pub use registry::{MessageInfo, Registry, ServiceInfo, ServiceSet};
pub use scale::{OutOfRange, Rounding, Scale, Scaled};
pub use service::{Call, Hazards, InternalEvent, Provider};
pub use text::Text;
pub use writer::Writer;

/// Lists of generated fields.
#[doc(no_inline)]
pub use alloc::vec::Vec as List;

#[doc(hidden)]
pub use crate::{
    __codec_accessor as accessor, __codec_accessors as accessors,
    __codec_alternatives as alternatives, __codec_arbitrary_integer as arbitrary_integer,
    __codec_bit_field as bit_field, __codec_enumeration as enumeration,
    __codec_fixed_newtype as fixed_newtype, __codec_if_arbitrary as if_arbitrary,
    __codec_if_serde as if_serde, __codec_members as members,
    __codec_random_alternatives as random_alternatives, __codec_random_members as random_members,
    __codec_requests as requests, __codec_scaled as scaled, __codec_sub_field as sub_field,
    __codec_sub_fields as sub_fields,
};

#[cfg(feature = "arbitrary")]
#[doc(hidden)]
pub use crate::__codec_random_member as random_member;

#[cfg(feature = "serde")]
#[doc(hidden)]
pub use crate::__codec_view_serde as serde_by_view;

/// Expands to its content if this crate has the feature `serde`, whatever the calling crate
/// enables.
#[cfg(feature = "serde")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_if_serde {
    ($($content:tt)*) => { $($content)* };
}

/// Expands to its content if this crate has the feature `serde`, whatever the calling crate
/// enables.
#[cfg(not(feature = "serde"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_if_serde {
    ($($content:tt)*) => {};
}

/// Expands to its content if this crate has the feature `arbitrary`, whatever the calling crate
/// enables.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_if_arbitrary {
    ($($content:tt)*) => { $($content)* };
}

/// Expands to its content if this crate has the feature `arbitrary`, whatever the calling crate
/// enables.
#[cfg(not(feature = "arbitrary"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_if_arbitrary {
    ($($content:tt)*) => {};
}

/// Implements `Arbitrary` for a newtype over an integer. Every integer is valid.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_arbitrary_integer {
    ($name:ident) => {
        impl<'a> $crate::arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(
                random: &mut $crate::arbitrary::Unstructured<'a>,
            ) -> $crate::arbitrary::Result<Self> {
                $crate::arbitrary::Arbitrary::arbitrary(random).map(Self)
            }
        }
    };
}

/// Expands to nothing without the feature `arbitrary`.
#[cfg(not(feature = "arbitrary"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_arbitrary_integer {
    ($name:ident) => {};
}
