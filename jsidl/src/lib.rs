//! JSIDL (AS5684), the language in which JAUS services are defined.
#![forbid(unsafe_code)]

pub mod build;
pub mod catalogue;
mod check;
mod diagnostic;
pub mod dynamic;
mod expr;
mod library;
mod loader;
pub mod model;
mod resolve;
pub mod rust;
mod source;
mod syntax;

pub use diagnostic::{Diagnostic, Diagnostics, Note, Severity};
pub use library::Library;
pub use loader::{Loaded, Loader};
