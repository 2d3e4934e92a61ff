//! Gathers definitions from files, directories and texts, and compiles them together.

use std::fs;
use std::path::{Path, PathBuf};

use crate::catalogue;
use crate::compact::{self, Known};
use crate::diagnostic::{Diagnostics, Report};
use crate::layout;
use crate::library::Library;
use crate::listing::Listing;
use crate::resolve::resolve;
use crate::source::Sources;
use crate::syntax::{Program, Strictness, check_strictly, excess, read};

/// Collects definitions; [`load`](Self::load) compiles them.
///
/// References resolve across everything that was added, in any order. If an identity is declared
/// several times, the first declaration counts.
#[derive(Debug, Default)]
pub struct Loader {
    sources: Sources,
    program: Program,
    report: Report,
    with_catalogue: bool,
    with_clients: bool,
    with_reference_architecture: bool,
    is_strict: bool,
    /// Texts in the compact form: what they refer to decides how they are read.
    compact: Vec<Compact>,
}

/// A text in the compact form.
#[derive(Debug)]
struct Compact {
    /// Its place among the sources.
    source: usize,
    is_strict: bool,
    root: compact::Element,
}

/// Result of a load.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// All sound definitions.
    pub library: Library,
    /// All errors and warnings.
    pub diagnostics: Diagnostics,
}

impl Loader {
    /// A loader without definitions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Holds the definitions that are added from now on against the letter of AS5684 as well, as a
    /// schema validator does: order of elements, mandatory parts, values of attributes. What it
    /// does not permit is an error, but does not make a definition unusable.
    pub fn strict(&mut self) -> &mut Self {
        self.is_strict = true;
        self
    }

    /// Adds a file, or all `.xml`, `.csd` and `.cjsidl` files below a directory. An unreadable file
    /// becomes a diagnostic.
    ///
    /// A file that does not begin with `<` may be in the compact form of the language, CJSIDL.
    pub fn path(&mut self, path: impl AsRef<Path>) -> &mut Self {
        let path = path.as_ref();
        if path.is_dir() {
            let found = Listing::of(path);
            if found.files.is_empty() && found.unreadable.is_empty() {
                let message = "this directory has no service definitions: their files end in \
                    `.xml`, `.csd` or `.cjsidl`";
                self.unreadable(path, message);
            }
            for (path, reason) in found.unreadable {
                self.unreadable(&path, &reason);
            }
            for file in found.files {
                self.file(&file, Strictness::Found);
            }
        } else {
            self.file(path, Strictness::Named);
        }
        self
    }

    /// Adds a text as if it were a file with this name.
    pub fn text(&mut self, name: impl AsRef<Path>, text: &str) -> &mut Self {
        self.add(name.as_ref(), text, Strictness::Named);
        self
    }

    /// Adds the definitions that ship with this crate, except those of the Reference Architecture;
    /// of the client services only those that another definition refers to. Definitions added by
    /// other means take precedence, in any order.
    pub fn catalogue(&mut self) -> &mut Self {
        self.with_catalogue = true;
        self
    }

    /// Adds [the catalogue](Self::catalogue) with all its client services, such as `EventsClient`.
    /// Their messages are those of the services that they use.
    pub fn clients(&mut self) -> &mut Self {
        self.with_clients = true;
        self.catalogue()
    }

    /// Adds the definitions of the Reference Architecture that ship with this crate. They use
    /// message codes of [the other definitions](Self::catalogue) for other layouts.
    pub fn reference_architecture(&mut self) -> &mut Self {
        self.with_reference_architecture = true;
        self
    }

    /// Compiles everything that was added.
    pub fn load(mut self) -> Loaded {
        self.translate();
        self.is_strict = false;
        let wanted: Vec<_> = catalogue::entries()
            .iter()
            .filter(|it| self.wants(it))
            .collect();
        for entry in wanted {
            self.embedded(entry);
        }
        self.referenced_clients();
        let library = resolve(&self.program, &self.sources, &mut self.report);
        Loaded {
            library,
            diagnostics: self.report.finish(&self.sources),
        }
    }

    /// The XML of all added texts in the compact form, each with its name, formatted. References
    /// are completed from everything that was added. A text with mistakes has no XML.
    #[must_use]
    pub fn xml(mut self) -> (Vec<(PathBuf, String)>, Diagnostics) {
        let places = self.translate();
        let documents = places.into_iter().map(|place| {
            let source = self.sources.at(place);
            (source.path().to_owned(), layout::document(source.xml()))
        });
        (documents.collect(), self.report.finish(&self.sources))
    }

    fn wants(&self, entry: &catalogue::Entry) -> bool {
        if entry.of_reference_architecture() {
            self.with_reference_architecture
        } else if entry.of_client() {
            self.with_clients
        } else {
            self.with_catalogue
        }
    }

    /// Adds the client services of the catalogue that something refers to, and those that they
    /// refer to.
    fn referenced_clients(&mut self) {
        if !self.with_catalogue || self.with_clients {
            return;
        }
        let clients = catalogue::entries().iter();
        let mut clients: Vec<_> = clients.filter(|it| it.of_client()).collect();
        loop {
            let urns = self.program.referenced();
            let (wanted, rest): (Vec<_>, Vec<_>) =
                clients.into_iter().partition(|it| urns.contains(it.urn));
            if wanted.is_empty() {
                return;
            }
            for entry in wanted {
                self.embedded(entry);
            }
            clients = rest;
        }
    }

    fn embedded(&mut self, entry: &catalogue::Entry) {
        self.add(&catalogue::name(entry), &entry.text(), Strictness::Named);
    }

    /// Translates the texts in the compact form and reads them. Returns the places of those without
    /// mistakes among the sources.
    fn translate(&mut self) -> Vec<usize> {
        let compact = std::mem::take(&mut self.compact);
        if compact.is_empty() {
            return Vec::new();
        }
        let known = self.known(&compact);
        let mut places = Vec::new();
        for text in compact {
            let before = self.report.errors();
            let source = self.sources.at(text.source);
            let translation = compact::translate(text.root, &known, source, &mut self.report);
            if self.report.errors() > before {
                continue;
            }
            places.push(text.source);
            let source = self.sources.translate(text.source, translation);
            read(
                source,
                Strictness::Named,
                &mut self.program,
                &mut self.report,
            );
            if text.is_strict {
                check_strictly(source, &mut self.report);
            }
        }
        places
    }

    /// What the texts in the compact form may refer to.
    fn known(&self, compact: &[Compact]) -> Known {
        let mut known = Known::default();
        compact.iter().for_each(|it| known.add(&it.root));
        let mut add = |text: &str| {
            // What is wrong with it is reported where it is read.
            if text.starts_with('<')
                && excess(text).is_none()
                && let Ok(root) = compact::of_xml(text)
            {
                known.add(&root);
            }
        };
        for source in self.sources.iter() {
            add(source.text());
        }
        let is_known =
            |it: &&catalogue::Entry| self.wants(it) || (it.of_client() && self.with_catalogue);
        for entry in catalogue::entries().iter().filter(is_known) {
            add(&entry.text());
        }
        known
    }

    fn add(&mut self, name: &Path, text: &str, strictness: Strictness) {
        let place = self.sources.count();
        let source = self.sources.add(name, text);
        if compact::is_compact(name, source.text()) {
            let root = compact::read(source, &mut self.report);
            self.compact.extend(root.map(|root| Compact {
                source: place,
                is_strict: self.is_strict,
                root,
            }));
            return;
        }
        read(source, strictness, &mut self.program, &mut self.report);
        if self.is_strict {
            check_strictly(source, &mut self.report);
        }
    }

    fn file(&mut self, path: &Path, strictness: Strictness) {
        match readable(path) {
            Ok(text) => self.add(path, &text, strictness),
            Err(reason) => self.unreadable(path, &reason),
        }
    }

    fn unreadable(&mut self, path: &Path, reason: &str) {
        let source = self.sources.add(path, "");
        self.report.error(source.span(0), reason);
    }
}

/// The text of a file, or the reason why it cannot be read.
fn readable(path: &Path) -> Result<String, String> {
    let metadata = fs::metadata(path).map_err(|error| format!("cannot read the file: {error}"))?;
    if !metadata.is_file() {
        return Err("neither a file nor a directory".into());
    }
    if metadata.len() > crate::syntax::LARGEST {
        return Err(format!(
            "the file is larger than {} MiB: split it",
            crate::syntax::LARGEST >> 20
        ));
    }
    let octets = fs::read(path).map_err(|error| format!("cannot read the file: {error}"))?;
    String::from_utf8(octets).map_err(|error| {
        format!(
            "the file is not UTF-8 at octet {}: convert it",
            error.utf8_error().valid_up_to()
        )
    })
}
