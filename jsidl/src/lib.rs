//! JSIDL (AS5684), the language in which JAUS services are defined.
#![forbid(unsafe_code)]

pub mod dynamic;
mod library;
pub mod model;

pub use library::Library;
