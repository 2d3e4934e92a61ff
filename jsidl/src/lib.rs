//! JSIDL (AS5684), the language in which JAUS services are defined.
//!
//! A [`Loader`] reads definitions and resolves them into a [`Library`] of [`model`] types, and
//! reports every mistake in its [`Diagnostics`]. From the model, [`rust`] and [`build`] generate
//! typed messages; [`dynamic`] encodes and decodes without generated code. [`behaviour`] holds the
//! protocol behaviour of services. The [`catalogue`] holds the definitions that ship with the
//! crate.
//!
//! ```
//! let mut loader = jsidl::Loader::new();
//! loader.catalogue();
//! let jsidl::Loaded { library, diagnostics } = loader.load();
//! assert!(!diagnostics.has_errors(), "{diagnostics}");
//!
//! let (service, message) = library.by_code(0x4B00).next().expect("the core set is there");
//! assert_eq!(service.id.to_string(), "urn:jaus:jss:core:Discovery 1.0");
//! assert_eq!(message.name, "ReportIdentification");
//! ```
#![forbid(unsafe_code)]

pub mod behaviour;
pub mod build;
pub mod catalogue;
mod check;
mod compact;
pub mod cpp;
mod diagnostic;
pub mod diff;
pub mod docs;
pub mod dynamic;
#[cfg(feature = "excerpts")]
mod excerpt;
pub mod explain;
mod expr;
mod fingerprint;
pub mod format;
mod grammar;
mod heads;
mod layout;
mod library;
mod listing;
mod loader;
pub mod lua;
pub mod machine;
pub mod model;
mod pairs;
pub mod permission;
pub mod presence;
pub mod python;
mod resolve;
pub mod ros;
pub mod rust;
#[cfg(feature = "json")]
pub mod schema;
mod source;
mod spelling;
mod syntax;
mod typed;
pub mod typescript;

pub use diagnostic::{Diagnostic, Diagnostics, Note, Severity};
#[cfg(feature = "excerpts")]
pub use excerpt::Style;
pub use library::Library;
pub use listing::definition_files;
pub use loader::{Loaded, Loader};
