//! Ids of components, and arguments that are ids.

use jaus::address;
use pyo3::prelude::*;

use super::failure::Failure;

/// The id of a component: subsystem, node and component, such as `JausId("107.1.33")`.
///
/// Functions that take an id take its text, too. 65535 for the subsystem and 255 for node and component
/// mean all of them.
#[pyclass(frozen, eq, ord, hash, module = "jaus", name = "JausId")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct JausId(pub(crate) address::JausId);

#[pymethods]
impl JausId {
    #[new]
    fn new(id: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(id_of(id)?))
    }

    /// 1 to 65534; 65535 means every subsystem.
    #[getter]
    fn subsystem(&self) -> u16 {
        self.0.subsystem()
    }

    /// 1 to 254; 255 means every node.
    #[getter]
    fn node(&self) -> u8 {
        self.0.node()
    }

    /// 1 to 254; 255 means every component.
    #[getter]
    fn component(&self) -> u8 {
        self.0.component()
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("JausId('{}')", self.0)
    }
}

/// An id, or its text.
pub(crate) fn id_of(value: &Bound<'_, PyAny>) -> PyResult<address::JausId> {
    if let Ok(id) = value.cast::<JausId>() {
        return Ok(id.get().0);
    }
    let text: String = value.extract().map_err(|_| {
        Failure::argument(format!(
            "{value} is not an id: give a text such as \"107.1.33\", or a JausId"
        ))
    })?;
    let parsed = text.parse::<address::JausId>();
    Ok(parsed.map_err(|error| Failure::of("ArgumentError", &error))?)
}

/// The id of one component.
pub(crate) fn one_component(value: &Bound<'_, PyAny>) -> PyResult<address::JausId> {
    let id = id_of(value)?;
    match id.is_unicast() {
        true => Ok(id),
        false => Err(Failure::argument(format!("{id} is not a single component")).into()),
    }
}
