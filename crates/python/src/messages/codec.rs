//! Encodes and decodes the messages of one definition.

use std::sync::Arc;

use jsidl::dynamic;
use jsidl::model::Message;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::{errors, tree};

/// The codec of a message: between octets, the JSON view, and a tree of Python objects.
#[pyclass(frozen, module = "jaus._jaus")]
pub(super) struct Codec {
    message: Arc<Message>,
}

impl Codec {
    pub(super) const fn of(message: Arc<Message>) -> Self {
        Self { message }
    }

    fn value(&self, content: &Bound<'_, PyAny>) -> PyResult<dynamic::Value> {
        tree::to_value(&self.message, content)
    }
}

#[pymethods]
impl Codec {
    /// The content of a message from its code to its last octet.
    fn decode<'py>(&self, py: Python<'py>, octets: &[u8]) -> PyResult<Bound<'py, PyAny>> {
        match dynamic::decode(&self.message, octets) {
            Ok(value) => tree::from_value(py, value),
            Err(error) => Err(errors::decoding(py, &error)),
        }
    }

    /// The octets of a message, from its code on.
    fn encode<'py>(
        &self,
        py: Python<'py>,
        content: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        match dynamic::encode(&self.message, &self.value(content)?) {
            Ok(octets) => Ok(PyBytes::new(py, &octets)),
            Err(error) => Err(errors::encoding(py, &error, &error.message, &error.path)),
        }
    }

    /// The JSON view, as text.
    fn to_json(&self, py: Python<'_>, content: &Bound<'_, PyAny>) -> PyResult<String> {
        match dynamic::to_json(&self.message, &self.value(content)?) {
            Ok(view) => Ok(view.to_string()),
            Err(error) => Err(errors::encoding(py, &error, &error.message, &error.path)),
        }
    }

    /// The content of a message from its JSON view.
    fn read_json<'py>(&self, py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
        let view = serde_json::from_str(text).map_err(|error| {
            PyValueError::new_err(format!("{}: not JSON: {error}", self.message.name))
        })?;
        match dynamic::from_json(&self.message, &view) {
            Ok(value) => tree::from_value(py, value),
            Err(error) => Err(errors::encoding(py, &error, &error.message, &error.path)),
        }
    }
}
