//! Message classes, made from JSIDL definitions.
//!
//! The classes themselves are written in Python (`jaus/messages`). This module gives them the
//! layouts of their messages ([`definitions`]), encodes and decodes ([`codec`]), and converts
//! scaled integers ([`scale`]).
//!
//! Between the two, the content of a message is a tree of plain Python objects, see [`tree`].

mod capture;
mod codec;
mod definitions;
mod errors;
mod scale;
mod tree;

use pyo3::prelude::*;

/// Adds the names of this module to the extension module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<definitions::Definitions>()?;
    module.add_class::<codec::Codec>()?;
    module.add_class::<scale::Scale>()?;
    module.add_function(wrap_pyfunction!(scale::single, module)?)?;
    module.add_class::<capture::CaptureReader>()
}
