//! Nodes, components, clients, subscriptions and control.

use pyo3::prelude::*;

/// Adds the names of this module to the extension module.
pub(crate) fn register(_module: &Bound<'_, PyModule>) -> PyResult<()> {
    Ok(())
}
