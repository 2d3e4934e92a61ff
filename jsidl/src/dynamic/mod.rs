//! Dynamic codec: encodes and decodes messages from their definitions at run time.
//!
//! Generated code is faster and typed; this codec serves definitions that become known at run time.
//! It is independent of the generated code, so that the two verify each other. Both follow the same
//! rule: accepted octets encode back to exactly the same octets.
//!
//! [`decode`] and [`encode`] convert between octets and a [`Value`]; with the feature `json`,
//! `to_json` and `from_json` convert between a [`Value`] and the readable JSON view.

mod decode;
mod encode;
mod error;
mod scale;
pub(crate) mod trace;
mod value;

#[cfg(feature = "arbitrary")]
mod arbitrary;
#[cfg(feature = "json")]
mod json;

#[cfg(feature = "arbitrary")]
pub use arbitrary::arbitrary;
pub(crate) use decode::decode_traced;
pub use decode::{decode, decode_with};
pub use encode::{encode, encode_with};
pub(crate) use encode::{mismatch, slots, unfit};
pub(crate) use error::Fault;
pub use error::{DecodeError, DecodeProblem, EncodeError, EncodeProblem, Path, Step};
#[cfg(feature = "json")]
pub use json::{JsonError, JsonProblem, Leaf, for_each_number, from_json, to_json};
pub use scale::{Steps, raw_from_real, real_from_raw, shortest_real};
pub use value::{Raw, Value};

/// Whether the counts of a message must respect the limits of its definition.
///
/// Layout never depends on `min_count` and `max_count`, and not every peer respects them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Limits {
    /// A count outside its limits is an error.
    #[default]
    Enforced,
    /// Every count that its type can hold is accepted, for reading real traffic.
    Ignored,
}

impl Limits {
    fn admit(self, count: &crate::model::Count, number: u64) -> bool {
        self == Self::Ignored || (count.min..=count.max).contains(&number)
    }
}

/// Maximum number of elements without octets in one message.
///
/// Such elements (for example empty records) take no octets of the input, so a count alone could
/// demand four thousand million of them. No published definition has any.
const MOST_EMPTY_ELEMENTS: u32 = 4096;

/// Remaining part of [`MOST_EMPTY_ELEMENTS`] in the current message.
struct EmptyElements(u32);

impl EmptyElements {
    const fn new() -> Self {
        Self(MOST_EMPTY_ELEMENTS)
    }

    /// Takes one; false if none is left.
    fn take(&mut self) -> bool {
        let left = self.0.checked_sub(1);
        self.0 = left.unwrap_or(0);
        left.is_some()
    }
}
