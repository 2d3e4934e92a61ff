//! The running half of the package: nodes, components and clients, as the Python files of the package use them.
//!
//! # Threads
//!
//! A node has a thread of its own, on which its links, components and services run. That thread never takes
//! the interpreter's lock: messages, news and results wait in a queue ([`EventQueue`](jaus_binding::EventQueue)),
//! whose descriptor the program's event loop watches. An event loop that does not come for them hangs: what it
//! drives is stopped, and what it controls is released (`jaus-binding`). The functions that stop a driver run on
//! a second thread ([`stop::Stopper`]), which takes the lock, and a third passes on the log ([`log`]).

mod client;
mod component;
mod control;
mod event;
mod failure;
mod id;
mod life;
mod log;
mod program;
mod settings;
mod stop;

use pyo3::prelude::*;

/// Registers the classes and functions of nodes.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<id::JausId>()?;
    module.add_class::<settings::Node>()?;
    module.add_class::<component::Component>()?;
    module.add_class::<client::Client>()?;
    module.add_class::<control::Control>()?;
    module.add_function(wrap_pyfunction!(log::set_log, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
