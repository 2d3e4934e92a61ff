//! Generates Rust from service definitions in a build script. A crate with its own definitions in
//! `services/` and the crate `jsidl` among its build-dependencies needs this in the `main` of its
//! `build.rs`:
//!
//! ```no_run
//! jsidl::build::Build::new()
//!     .path("services")
//!     .module("messages", "urn:example:")
//!     .run();
//! ```
//!
//! and this in its library, beside a dependency on `jaus`:
//!
//! ```ignore
//! pub mod messages {
//!     include!(concat!(env!("OUT_DIR"), "/messages.rs"));
//! }
//! ```
//!
//! With [`runtime("::jaus_codec")`](Build::runtime) the library needs only the crate `jaus-codec`; then it
//! may be `no_std`.
//!
//! Mistakes in definitions come out as errors of the build, with file, line and column.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::catalogue;
use crate::diagnostic::{Diagnostic, Severity};
use crate::loader::Loader;
use crate::model::Service;
use crate::rust;

/// What to generate, and from which definitions.
#[derive(Debug)]
pub struct Build {
    loader: Loader,
    settings: rust::Settings,
    /// Names, each with the beginnings of URNs.
    modules: Vec<(String, Vec<String>)>,
    paths: Vec<PathBuf>,
    out_dir: Option<PathBuf>,
}

impl Default for Build {
    fn default() -> Self {
        Self::new()
    }
}

impl Build {
    /// Generates nothing yet. The definitions that come with this crate are there to be referred
    /// to; types are generated only for what [`module`](Self::module) names.
    pub fn new() -> Self {
        let mut loader = Loader::new();
        loader.clients().reference_architecture();
        Self {
            loader,
            settings: rust::Settings::new("::jaus::codec"),
            modules: Vec::new(),
            paths: Vec::new(),
            out_dir: None,
        }
    }

    /// Adds a file of definitions, or a directory with all below it. The script runs again when
    /// something in it changes.
    #[must_use]
    pub fn path(mut self, path: impl AsRef<Path>) -> Self {
        self.loader.path(&path);
        self.paths.push(path.as_ref().to_owned());
        self
    }

    /// Generates `<name>.rs`, with the services whose URN begins with `urn`, for example
    /// `urn:jaus:jss:core:`. Said again with the same name, it adds to that module. A client service
    /// of this crate, such as `urn:jaus:jss:core:EventsClient`, must be named in full.
    #[must_use]
    pub fn module(mut self, name: &str, urn: &str) -> Self {
        match self.modules.iter_mut().find(|(known, _)| known == name) {
            Some((_, urns)) => urns.push(urn.to_owned()),
            None => self.modules.push((name.to_owned(), vec![urn.to_owned()])),
        }
        self
    }

    /// Where the generated code finds the codec runtime; `::jaus::codec` if nothing is said.
    #[must_use]
    pub fn runtime(mut self, path: &str) -> Self {
        self.settings = self.settings.with_runtime(path);
        self
    }

    /// Where the generated code finds the messages of services whose URN begins with `urn`, as
    /// [`rust::Settings::extern_path`] describes: `.extern_path("urn:jaus:jss:core:",
    /// "::jaus::messages::core")`.
    #[must_use]
    pub fn extern_path(mut self, urn: &str, path: &str) -> Self {
        self.settings = self.settings.extern_path(urn, path);
        self
    }

    /// Whether the compiler warns of uses of deprecated messages, as
    /// [`rust::Settings::warn_of_deprecated`] describes.
    #[must_use]
    pub fn warn_of_deprecated(mut self, warns: bool) -> Self {
        self.settings = self.settings.warn_of_deprecated(warns);
        self
    }

    /// Where to write; `OUT_DIR` if nothing is said.
    #[must_use]
    pub fn out_dir(mut self, path: impl Into<PathBuf>) -> Self {
        self.out_dir = Some(path.into());
        self
    }

    /// Writes the modules, and tells Cargo what to watch and what is wrong.
    pub fn run(mut self) {
        let mut watched = std::mem::take(&mut self.paths);
        watched.push("build.rs".into());
        for path in watched {
            println!("cargo::rerun-if-changed={}", path.display());
        }
        let out_dir = self
            .out_dir
            .take()
            .or_else(|| env::var_os("OUT_DIR").map(PathBuf::from));
        let Some(out_dir) = out_dir else {
            error("there is no OUT_DIR: call this from a build script, or name an `out_dir`");
            return;
        };
        let (files, diagnostics) = self.generate();
        for diagnostic in &diagnostics {
            report(diagnostic);
        }
        for (name, text) in files {
            let path = out_dir.join(name);
            if let Err(reason) = fs::write(&path, text) {
                error(&format!("cannot write {}: {reason}", path.display()));
            }
        }
    }

    /// The modules as files, name and text, and everything that is to be said about the
    /// definitions. A module without services has empty tables.
    pub fn generate(self) -> (Vec<(String, String)>, crate::Diagnostics) {
        let loaded = self.loader.load();
        let module = |(name, urns): &(String, Vec<String>)| {
            let services = loaded.library.services().map(AsRef::<Service>::as_ref);
            let chosen = services.filter(|it| urns.iter().any(|urn| is_meant(it, urn)));
            let text = rust::module_with(&loaded.library, chosen, &self.settings);
            (format!("{name}.rs"), text)
        };
        let files = self.modules.iter().map(module).collect();
        (files, loaded.diagnostics)
    }
}

/// Whether the beginning of a URN selects a service. Client services have the messages of others,
/// so those of the catalogue would only repeat them.
fn is_meant(service: &Service, urn: &str) -> bool {
    let id = &*service.id.urn;
    id == urn || id.starts_with(urn) && !catalogue::holds_client(&service.location)
}

fn report(diagnostic: &Diagnostic) {
    match diagnostic.severity {
        Severity::Error => error(&diagnostic.to_string()),
        Severity::Warning => instruct("warning", &diagnostic.to_string()),
    }
}

fn error(text: &str) {
    instruct("error", text);
}

/// An instruction to Cargo is one line.
fn instruct(kind: &str, text: &str) {
    for line in text.lines() {
        println!("cargo::{kind}={line}");
    }
}
