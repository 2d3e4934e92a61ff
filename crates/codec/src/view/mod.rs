//! What people read and write: messages as trees of names and plain values, for JSON and its like.
//!
//! | in the definition | in the view |
//! |---|---|
//! | record, sequence | object of the members that are present, in the order of the definition |
//! | list, array | array |
//! | variant | object with one key, the alternative's name |
//! | integers, value sets | integer; reading takes the value's name as well |
//! | floating point | shortest decimal; `"NaN"`, `"Infinity"`, `"-Infinity"` |
//! | scaled integers | the decimal with the fewest digits that gives the same integer |
//! | bit fields | object of the sub-fields, and `"_reserved"` for other bits that are set |
//! | strings | text, or `{"hex": "…"}` if it is not UTF-8 |
//! | raw octets | lower-case hex text; with a format, `{"format": 1, "data": "…"}` |
//! | variable fields | `{"index": 1, "units": "meter", "value": 2.5}` |
//!
//! Every generated type has a [`View`], and through it serde's `Serialize` and `Deserialize` (for
//! formats that describe themselves).

mod impls;
mod value;

use std::fmt;

#[doc(hidden)]
pub use serde;

pub use value::{Object, Value};

#[doc(hidden)]
pub use impls::{bits, choice, choice_of, raw_bits, raw_scaled, scaled};

use super::OutOfRange;

/// A type that people can read and write.
pub trait View: Sized {
    /// What people see.
    fn view(&self) -> Value;

    /// The value that people mean.
    ///
    /// # Errors
    /// If it is not of the form described [above](self), or outside the limits of a field.
    fn from_view(value: &Value) -> Result<Self, Error>;

    /// What a member stands for that is not there, if it may be left out.
    fn absent() -> Option<Self> {
        None
    }
}

/// What is wrong with a view, and at which field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// Innermost first.
    path: Vec<String>,
    sentence: String,
}

impl Error {
    /// A mistake in the value itself.
    pub fn new(sentence: impl Into<String>) -> Self {
        Self {
            path: Vec::new(),
            sentence: sentence.into(),
        }
    }

    /// A key that is none of those known.
    pub fn unknown_key(key: &str, known: &[&str]) -> Self {
        let known = if known.is_empty() {
            "none".to_owned()
        } else {
            known.join(", ")
        };
        Self::new(format!("unknown key \"{key}\"; known here: {known}"))
    }

    /// Adds the member in which the mistake was met.
    #[cold]
    #[inline(never)]
    #[must_use]
    pub fn within(mut self, member: &str) -> Self {
        self.path.push(member.to_owned());
        self
    }

    /// Adds the index of the element in which the mistake was met.
    #[must_use]
    pub fn element(mut self, index: usize) -> Self {
        self.path.push(format!("[{index}]"));
        self
    }
}

impl std::error::Error for Error {}

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

/// Gives a type that has a [`View`] serde's `Serialize` and `Deserialize`.
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

#[doc(hidden)]
pub use crate::__codec_view_serde as serde_by_view;

impl serde::Serialize for dyn super::AnyMessage {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serde::Serialize::serialize(&self.view(), serializer)
    }
}
