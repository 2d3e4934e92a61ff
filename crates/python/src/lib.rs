//! The extension module `jaus._jaus` of the Python package `jaus`, over the SAE JAUS node stack [`jaus`].

mod messages;
mod node;

use pyo3::prelude::*;

/// The classes and functions that the package's Python files import.
#[pymodule]
fn _jaus(module: &Bound<'_, PyModule>) -> PyResult<()> {
    messages::register(module)?;
    node::register(module)
}
