//! Generates a ROS 2 package of message types, and the values of its messages.
//!
//! [`Package::files`] are the files that `colcon build` expects: an interface definition (`.msg`) for
//! each message and each type inside a message, `package.xml` and `CMakeLists.txt`.
//! [`Interface::value`] converts a message that the [dynamic codec](crate::dynamic) has decoded to
//! the fields of its `.msg` file. Files and values are written from the same fields, so that they
//! agree.
//!
//! A type is named after set, message and version, and a type inside a message after both:
//! `MobilityReportGlobalPoseV1p0` and `MobilityReportGlobalPoseV1p0TimeStamp` are defined by version 1.0
//! of the mobility set. The version is the oldest that has the layout. Further definitions therefore
//! do not change the name of a type, unless they belong to the same or an older version of the same
//! set. (A name that is in use gets a number. Names must differ in more than case.)
//!
//! | JSIDL | ROS 2 |
//! |---|---|
//! | integer, `float`, `long float` | the type of the same size |
//! | scaled integer | `float64`, in the unit of the definition |
//! | named values | constants of the integer, beginning with the field's name |
//! | bit field | a message: `bool` for one bit, otherwise the smallest integer. `reserved` has the bits without a name, in place |
//! | string | `string`; octets that are not UTF-8, and zeros, become U+FFFD |
//! | `variable_length_field` | `uint8[]` |
//! | `variable_format_field` | a message of `format` and `data` |
//! | record, sequence | a message |
//! | list | an unbounded sequence |
//! | `array` | an array in the order of the wire; above 1024 elements an unbounded sequence |
//! | optional member | a sequence of at most one element |
//! | variant, `variable_field` | a message: `kind` or `index` with constants, then each alternative as an optional member |
//!
//! ROS 2 has no sequences of sequences. Where JSIDL has them, for example in an optional list, the
//! inner one is in a message of its own.

mod conversion;
mod definitions;
mod nested;
mod package;
mod package_name;
mod text;
mod value;

pub use package::{Interface, Package};
pub use package_name::{PackageName, PackageNameError};
pub use value::Value;
