//! The exceptions of `jaus.errors`.

use std::fmt::Display;

use jsidl::dynamic;
use pyo3::PyErrArguments;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The exception of `jaus.errors` with this name.
pub(super) fn exception<A>(py: Python<'_>, name: &str, arguments: A) -> PyErr
where
    A: PyErrArguments + Send + Sync + 'static,
{
    let class = py.import("jaus.errors").and_then(|it| it.getattr(name));
    let class = class.and_then(|it| Ok(it.cast_into::<PyType>()?));
    match class {
        Ok(class) => PyErr::from_type(class, arguments),
        Err(error) => error,
    }
}

/// `jaus.DecodeError` with the place of the problem.
pub(super) fn decoding(py: Python<'_>, error: &dynamic::DecodeError) -> PyErr {
    let arguments = (
        error.to_string(),
        error.message.clone(),
        error.path.to_string(),
        error.offset,
    );
    exception(py, "DecodeError", arguments)
}

/// `jaus.FieldError` with the place of the problem.
pub(super) fn encoding(
    py: Python<'_>,
    text: &impl Display,
    message: &str,
    path: &dynamic::Path,
) -> PyErr {
    let arguments = (text.to_string(), message.to_owned(), path.to_string());
    exception(py, "FieldError", arguments)
}
