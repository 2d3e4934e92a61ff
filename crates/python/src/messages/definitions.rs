//! Definitions of services, and the classes that Python makes from them.

use std::path::PathBuf;
use std::sync::Arc;

use jsidl::model::{Id, Message, Service};
use jsidl::python::{self, ClassDescription};
use jsidl::{Library, Loaded, Loader, catalogue};
use pyo3::exceptions::{PyFileNotFoundError, PyIndexError};
use pyo3::prelude::*;

use super::codec::Codec;
use super::errors::exception;

/// Services that were loaded together.
#[pyclass(frozen, module = "jaus._jaus")]
pub(super) struct Definitions {
    classes: Vec<Class>,
    /// The findings in the definitions, as text; empty if there are none.
    #[pyo3(get)]
    findings: String,
}

struct Class {
    set: String,
    urn: String,
    described: ClassDescription,
    message: Arc<Message>,
}

/// The entry of a class in the index that Python receives: set, its URN, message name, message code,
/// versions with names, name in the set, services with versions.
type Entry = (
    String,
    String,
    String,
    u16,
    Vec<(String, String)>,
    Option<String>,
    Vec<(String, String)>,
);

#[pymethods]
impl Definitions {
    /// The definitions that come with the package.
    #[staticmethod]
    fn catalogue(py: Python<'_>) -> Self {
        py.detach(|| {
            let mut loader = Loader::new();
            loader.catalogue();
            Self::of(&loader.load(), |_| true)
        })
    }

    /// The definitions in files and directories. They may refer to those of the package. Those with
    /// errors are left out, or raise `jaus.DefinitionError`.
    #[staticmethod]
    fn load(py: Python<'_>, paths: Vec<PathBuf>, skips_errors: bool) -> PyResult<Self> {
        let loaded = read(py, paths, skips_errors)?;
        Ok(py.detach(|| Self::of(&loaded, is_foreign)))
    }

    /// The type stubs of definitions in files and directories, by file name.
    #[staticmethod]
    fn stubs(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<Vec<(String, String)>> {
        let loaded = read(py, paths, false)?;
        Ok(python::files(&loaded.library, is_foreign))
    }

    /// All classes, older versions first. Their position is the number of [`layout`](Self::layout)
    /// and [`codec`](Self::codec).
    fn index(&self) -> Vec<Entry> {
        let entries = self.classes.iter().map(|class| {
            let described = &class.described;
            let services = described.services.iter();
            (
                class.set.clone(),
                class.urn.clone(),
                described.message.clone(),
                described.code,
                described.places.clone(),
                described.newest.clone(),
                services
                    .map(|id| (id.urn.to_string(), id.version.to_string()))
                    .collect(),
            )
        });
        entries.collect()
    }

    /// Members and nested types of a class, as JSON.
    fn layout(&self, number: usize) -> PyResult<String> {
        Ok(self.class(number)?.described.layout.to_string())
    }

    /// The codec of a class.
    fn codec(&self, number: usize) -> PyResult<Codec> {
        Ok(Codec::of(self.class(number)?.message.clone()))
    }
}

impl Definitions {
    fn of(loaded: &Loaded, wanted: fn(&Service) -> bool) -> Self {
        let sets = python::describe(&loaded.library, wanted);
        let classes = sets.into_iter().flat_map(|set| {
            let (name, urn) = (set.name, set.urn);
            let classes = set.classes.into_iter();
            classes.filter_map(move |described| {
                let message = message_of(&loaded.library, &described)?;
                Some(Class {
                    set: name.clone(),
                    urn: urn.clone(),
                    described,
                    message,
                })
            })
        });
        Self {
            classes: classes.collect(),
            findings: loaded.diagnostics.to_string(),
        }
    }

    fn class(&self, number: usize) -> PyResult<&Class> {
        let class = self.classes.get(number);
        class.ok_or_else(|| PyIndexError::new_err(format!("there is no class {number}")))
    }
}

/// The newest declaration of a class's layout, as the plan of the class uses it.
fn message_of(library: &Library, described: &ClassDescription) -> Option<Arc<Message>> {
    let newest: Option<&Id> = described.services.iter().max_by_key(|id| id.version);
    let mut messages = library.service(newest?)?.messages();
    let found = messages.find(|it| it.code == described.code && it.name == described.message);
    found.cloned()
}

/// Whether a service does not come with the package.
fn is_foreign(service: &Service) -> bool {
    !catalogue::holds(&service.location)
}

/// Reads definitions, and those of the package besides.
fn read(py: Python<'_>, paths: Vec<PathBuf>, skips_errors: bool) -> PyResult<Loaded> {
    for path in &paths {
        if !path.exists() {
            let problem = format!("{}: there is no such file or directory", path.display());
            return Err(PyFileNotFoundError::new_err(problem));
        }
    }
    let loaded = py.detach(|| {
        let mut loader = Loader::new();
        for path in paths {
            loader.path(path);
        }
        loader.catalogue();
        loader.load()
    });
    if loaded.diagnostics.has_errors() && !skips_errors {
        let text = (loaded.diagnostics.to_string(),);
        return Err(exception(py, "DefinitionError", text));
    }
    Ok(loaded)
}
