//! JSON view of messages, for people and tools.
//!
//! | JSIDL | JSON |
//! |---|---|
//! | record, sequence | object of the members that are present, in document order |
//! | list | array of its elements |
//! | variant | object with one key, the alternative's name; `{}` if there is no alternative |
//! | fixed_field | integer; `float`s with the fewest digits of their type, or `"NaN"`, `"Infinity"`, `"-Infinity"` |
//! | … with scale_range | the decimal with the fewest digits that encodes back to the same integer |
//! | … with value_set | the integer; the enumerator's text is understood as well |
//! | bit_field | object of its sub-fields, and `"_reserved"`: the other bits, where they are not 0 |
//! | strings | text; `{"hex": "…"}` where the octets are not UTF-8 |
//! | variable_length_field | text of hexadecimal digits |
//! | variable_format_field | `{"format": index, "data": "hex"}`; the format's name is understood as well |
//! | variable_field | `{"index": n, "units": "meter", "value": …}`; units are not read |
//! | array | nested arrays, indexed in the order of the dimensions |
//!
//! The body's own composite is not shown; an empty body is `{}`. Only if a message has its own
//! header or footer, the three parts are in an object with the keys `header`, `body` and `footer`.
//! A NaN is restored as the default quiet NaN.

mod hex;
mod leaves;
mod read;
mod write;

use std::fmt;

pub use leaves::{Leaf, for_each_number};
pub use read::from_json;
pub use write::to_json;

use super::Path;
use super::error::{Fault, write_place};

/// The key of the bits that no sub-field owns.
const RESERVED: &str = "_reserved";

/// The key of the octets of a string that is not UTF-8.
const HEX: &str = "hex";

/// The keys of the parts of a message with its own header or footer.
const SECTIONS: [&str; 3] = ["header", "body", "footer"];

/// JSON that is not a view of the given definition.
#[derive(Debug, Clone, PartialEq)]
pub struct JsonError {
    /// The message's name.
    pub message: String,
    /// The field.
    pub path: Path,
    /// The problem.
    pub problem: JsonProblem,
}

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, &self.message, &self.path)?;
        self.problem.fmt(f)
    }
}

impl std::error::Error for JsonError {}

/// Problems of JSON.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JsonProblem {
    /// An object has an unknown key.
    #[error("unknown key \"{key}\"; known keys: {known}")]
    UnknownKey {
        /// The key.
        key: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// A required member is absent.
    #[error("required, but absent")]
    Missing,
    /// A value of another kind than the definition requires.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// The required kind.
        expected: String,
        /// The actual value, shortened.
        found: String,
    },
    /// A real number outside the range of a scaled integer, which includes its limits.
    #[error("{value} is outside the range from {lower} to {upper} {units}")]
    OutOfRange {
        /// The number.
        value: f64,
        /// The least number.
        lower: f64,
        /// The greatest number.
        upper: f64,
        /// The units of all three.
        units: String,
    },
}

impl Fault<JsonProblem> {
    fn reading(self, message: &str) -> JsonError {
        let (path, _, problem) = self.path();
        JsonError {
            message: message.to_owned(),
            path,
            problem,
        }
    }
}
