//! Message types of ROS 2: the model, the `.msg` text, and sets of types that refer to each other.

mod bundled;
mod fit;
mod literal;
mod parse;
mod set;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

pub(crate) use fit::{defaults, fit, zero_of};
pub use parse::{Definition, ParseError};
pub use set::{InterfaceError, Interfaces};

use crate::Value;

/// The most octets of a name of a package, a type, a field or a constant.
pub(crate) const LONGEST_NAME: usize = 255;

/// The name of a message type, such as `geometry_msgs/msg/Twist`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TypeName {
    package: String,
    name: String,
}

/// A text is no name of a message type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not the name of a message type: write for example geometry_msgs/msg/Twist")]
pub struct TypeNameError(String);

impl TypeName {
    /// A type of a package.
    ///
    /// # Errors
    /// The package is not in `lower_case`, or the name is not in `CamelCase`.
    pub fn new(package: &str, name: &str) -> Result<Self, TypeNameError> {
        if !is_lower_case(package) || !is_camel_case(name) {
            let text = format!("{package}/msg/{name}");
            return Err(TypeNameError(shown(&text)));
        }
        Ok(Self {
            package: package.to_owned(),
            name: name.to_owned(),
        })
    }

    /// The package, such as `geometry_msgs`.
    #[must_use]
    pub fn package(&self) -> &str {
        &self.package
    }

    /// The name within the package, such as `Twist`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name that DDS and rmw_zenoh use, such as `geometry_msgs::msg::dds_::Twist_`.
    #[must_use]
    pub fn dds(&self) -> String {
        format!("{}::msg::dds_::{}_", self.package, self.name)
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/msg/{}", self.package, self.name)
    }
}

impl FromStr for TypeName {
    type Err = TypeNameError;

    /// Parses `package/msg/Name` or `package/Name`.
    fn from_str(text: &str) -> Result<Self, TypeNameError> {
        let (package, rest) = text
            .split_once('/')
            .ok_or_else(|| TypeNameError(shown(text)))?;
        Self::new(package, rest.strip_prefix("msg/").unwrap_or(rest))
            .map_err(|_| TypeNameError(shown(text)))
    }
}

/// A text for an error message or the log: of bounded length, in printable characters.
pub(crate) fn shown(text: &str) -> String {
    jaus_text::shortened(text, 100).into_owned()
}

/// Whether a name of a package or a field follows ROS's rules.
pub(crate) fn is_lower_case(name: &str) -> bool {
    name.len() <= LONGEST_NAME
        && name.starts_with(|first: char| first.is_ascii_lowercase())
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_')
}

fn is_camel_case(name: &str) -> bool {
    name.len() <= LONGEST_NAME
        && name.starts_with(|first: char| first.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric())
}

/// A type that is not built from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Primitive {
    /// `bool`
    Bool,
    /// `byte`: an octet, encoded like `uint8`, with another type hash.
    Byte,
    /// `int8`
    Int8,
    /// `uint8`, and `char`, which is the same.
    Uint8,
    /// `int16`
    Int16,
    /// `uint16`
    Uint16,
    /// `int32`
    Int32,
    /// `uint32`
    Uint32,
    /// `int64`
    Int64,
    /// `uint64`
    Uint64,
    /// `float32`
    Float32,
    /// `float64`
    Float64,
}

/// The type of a field, or of the elements of an array. `N` is how a message type is referred to:
/// by the type itself, or before it is resolved, by its name.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind<N = Arc<Interface>> {
    /// A number or a truth value.
    Primitive(Primitive),
    /// A text.
    String {
        /// The most octets of the text, without the NUL of the encoding.
        most: Option<usize>,
    },
    /// Another message.
    Message(N),
}

/// How many values a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// One value: the field is no array.
    One,
    /// This many: `float64[36]`.
    Fixed(usize),
    /// At most this many: `uint8[<=8]`.
    AtMost(usize),
    /// Any number: `string[]`.
    Any,
}

/// A field of a message type.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<N = Arc<Interface>> {
    /// The name.
    pub name: String,
    /// The type, of the elements if the field is an array.
    pub kind: Kind<N>,
    /// How many values it has.
    pub size: Size,
    /// The value in a new message, if it is not zero or empty.
    pub default: Option<Value>,
}

/// A constant of a message type.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// The name.
    pub name: String,
    /// The value.
    pub value: Value,
}

/// A message type whose nested types are all known.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    pub(crate) name: TypeName,
    pub(crate) fields: Vec<Field>,
    pub(crate) constants: Vec<Constant>,
    /// The number of values of a new message, those of nested messages included.
    pub(crate) values: usize,
    /// How many levels of messages it has; 1 without nested ones.
    pub(crate) levels: usize,
}

impl Interface {
    /// The name.
    #[must_use]
    pub const fn name(&self) -> &TypeName {
        &self.name
    }

    /// The fields, in the order of the encoding.
    #[must_use]
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// The constants.
    #[must_use]
    pub fn constants(&self) -> &[Constant] {
        &self.constants
    }

    /// The value of a constant, such as `STATUS_FIX`.
    #[must_use]
    pub fn constant(&self, name: &str) -> Option<&Value> {
        let constant = self.constants.iter().find(|it| it.name == name)?;
        Some(&constant.value)
    }
}
