//! Human-readable views: messages as trees of names and plain values, for JSON and similar formats.
//!
//! | in the definition | in the view |
//! |---|---|
//! | record, sequence | object of the members that are present, in the order of the definition |
//! | list, array | array |
//! | variant | object with one key, the alternative's name |
//! | integers, value sets | integer, with the value's [name](Value::Named); when read, also the name |
//! | floating point | shortest decimal; `"NaN"`, `"Infinity"`, `"-Infinity"` |
//! | scaled integers | the decimal with the fewest digits that gives the same integer |
//! | bit fields | object of the sub-fields, and `"_reserved"` for other bits that are set |
//! | strings | text, or `{"hex": "…"}` if it is not UTF-8 |
//! | raw octets | lower-case hex text; with a format, `{"format": 1, "data": "…"}` |
//! | variable fields | `{"index": 1, "units": "meter", "value": 2.5}` |
//!
//! Every generated type implements [`View`], and on top of it serde's `Serialize` and `Deserialize`
//! (for self-describing formats).

mod impls;
mod value;

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;

#[doc(hidden)]
pub use serde;

pub use value::{Object, Value};

#[doc(hidden)]
pub use impls::{bits, choice, choice_of, enumerated, raw_bits, raw_scaled, scaled};

use super::scale::OutOfRange;

/// A type with a human-readable view.
pub trait View: Sized {
    /// Converts to the view.
    fn view(&self) -> Value;

    /// Converts from the view.
    ///
    /// # Errors
    /// If the view does not have the form described [above](self), or a value exceeds the limits of
    /// its field.
    fn from_view(value: &Value) -> Result<Self, Error>;

    /// Default for an absent member, if it is optional.
    fn absent() -> Option<Self> {
        None
    }
}

/// Cause and location of an invalid view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Innermost first.
    path: Vec<String>,
    sentence: String,
}

impl Error {
    /// An error in the value itself.
    pub fn new(sentence: impl Into<String>) -> Self {
        Self {
            path: Vec::new(),
            sentence: sentence.into(),
        }
    }

    /// An unknown key, with the list of known keys.
    pub fn unknown_key(key: &str, known: &[&str]) -> Self {
        let known = if known.is_empty() {
            "none".to_owned()
        } else {
            known.join(", ")
        };
        Self::new(format!("unknown key \"{key}\"; known keys: {known}"))
    }

    /// Adds the enclosing member to the path.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn within(mut self, member: &str) -> Self {
        self.path.push(member.to_owned());
        self
    }

    /// Adds the index of the enclosing element to the path.
    #[must_use]
    pub fn element(mut self, index: usize) -> Self {
        self.path.push(format!("[{index}]"));
        self
    }
}

impl core::error::Error for Error {}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, step) in self.path.iter().rev().enumerate() {
            if i > 0 && !step.starts_with('[') {
                f.write_str(".")?;
            }
            f.write_str(step)?;
        }
        if !self.path.is_empty() {
            f.write_str(": ")?;
        }
        f.write_str(&self.sentence)
    }
}

impl From<OutOfRange> for Error {
    fn from(error: OutOfRange) -> Self {
        Self::new(error.to_string())
    }
}

/// Implements serde's `Serialize` and `Deserialize` for a type with a [`View`].
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_view_serde {
    ($name:ident) => {
        impl $crate::view::serde::Serialize for $name {
            fn serialize<S: $crate::view::serde::Serializer>(
                &self,
                serializer: S,
            ) -> Result<S::Ok, S::Error> {
                let view = $crate::view::View::view(self);
                $crate::view::serde::Serialize::serialize(&view, serializer)
            }
        }

        impl<'de> $crate::view::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::view::serde::Deserializer<'de>>(
                deserializer: D,
            ) -> Result<Self, D::Error> {
                let value = $crate::view::serde::Deserialize::deserialize(deserializer)?;
                $crate::view::View::from_view(&value)
                    .map_err($crate::view::serde::de::Error::custom)
            }
        }
    };
}
