//! Definitions that ship with the crate, embedded: they need no source files at run time.
//!
//! Definitions are grouped into sets, for example `core` (AS5710) and `mobility` (AS6009).
//! [`Loader::catalogue`](crate::Loader::catalogue) loads all sets except
//! [those of the Reference Architecture](Entry::of_reference_architecture), whose message codes
//! collide with the others;
//! [`Loader::reference_architecture`](crate::Loader::reference_architecture) loads those.
//!
//! [Client services](Entry::of_client) have the messages of the services that they use. They are
//! loaded if a definition refers to them, or all of them by
//! [`Loader::clients`](crate::Loader::clients).

use std::path::{Path, PathBuf};

use crate::model::{Id, Location};

/// Folder of the embedded files in reported paths.
const FOLDER: &str = "catalogue";

/// One embedded file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// The set, for example `core`.
    pub set: &'static str,
    /// Path within the catalogue, for example `core/Discovery.xml`.
    pub path: &'static str,
    /// The root element: `service_def`, `declared_type_set` or `declared_const_set`.
    pub element: &'static str,
    /// The declared URN.
    pub urn: &'static str,
    /// The declared version, for example `1.1`.
    pub version: &'static str,
    /// The XML text, packed as raw deflate.
    packed: &'static [u8],
}

/// The directory of client services within a set.
const CLIENTS: &str = "clients";

/// The sets of the Reference Architecture.
const REFERENCE_ARCHITECTURE: &[&str] = &["ra33"];

impl Entry {
    /// Whether the messages belong to the Reference Architecture, the predecessor of the SAE
    /// standards: it uses the same codes for other layouts, so a code alone must not select them.
    #[must_use]
    pub fn of_reference_architecture(&self) -> bool {
        REFERENCE_ARCHITECTURE.contains(&self.set)
    }

    /// Whether this is a client service, such as `EventsClient`: it sends what another service
    /// receives, and receives what that one sends.
    #[must_use]
    pub fn of_client(&self) -> bool {
        self.path.split('/').nth(1) == Some(CLIENTS)
    }

    /// The XML text.
    #[must_use]
    pub fn text(&self) -> String {
        let text = miniz_oxide::inflate::decompress_to_vec(self.packed).ok();
        #[expect(
            clippy::expect_used,
            reason = "the build script packed valid text, and a test reads all of it"
        )]
        let text = text
            .and_then(|octets| String::from_utf8(octets).ok())
            .expect("the catalogue is whole");
        text
    }
}

static ENTRIES: &[Entry] = &include!(concat!(env!("OUT_DIR"), "/catalogue.rs"));

/// All embedded files, ordered by set and path.
pub fn entries() -> &'static [Entry] {
    ENTRIES
}

/// The names of the sets, in alphabetical order.
pub fn sets() -> impl Iterator<Item = &'static str> {
    let mut sets: Vec<_> = ENTRIES.iter().map(|entry| entry.set).collect();
    sets.dedup();
    sets.into_iter()
}

/// The file that declares exactly this URN and version.
pub fn find(id: &Id) -> Option<&'static Entry> {
    let version = id.version.to_string();
    ENTRIES
        .iter()
        .find(|entry| entry.urn == &*id.urn && entry.version == version)
}

/// Whether a location is in an embedded file, as [`Loader::catalogue`](crate::Loader::catalogue)
/// names them.
pub fn holds(location: &Location) -> bool {
    entry_of(location).is_some()
}

/// Whether a location is in the file of an embedded [client service](Entry::of_client).
pub(crate) fn holds_client(location: &Location) -> bool {
    entry_of(location).is_some_and(Entry::of_client)
}

fn entry_of(location: &Location) -> Option<&'static Entry> {
    let path = location.file.strip_prefix(FOLDER).ok()?;
    ENTRIES.iter().find(|entry| Path::new(entry.path) == path)
}

/// Path of an embedded file in findings.
pub(crate) fn name(entry: &Entry) -> PathBuf {
    Path::new(FOLDER).join(entry.path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loader::Loader;

    #[test]
    fn every_embedded_definition_is_sound() {
        let mut loader = Loader::new();
        loader.clients().reference_architecture();
        let loaded = loader.load();
        assert_eq!(loaded.diagnostics.to_string(), "");
        let services = ENTRIES.iter().filter(|e| e.element == "service_def");
        assert_eq!(loaded.library.services().count(), services.count());
    }

    #[test]
    fn each_of_the_two_architectures_is_whole_without_the_other() {
        let urns = |fill: fn(&mut Loader) -> &mut Loader| {
            let mut loader = Loader::new();
            fill(&mut loader);
            let loaded = loader.load();
            assert_eq!(loaded.diagnostics.to_string(), "");
            let urns = loaded.library.services().map(|it| it.id.urn.to_string());
            urns.collect::<Vec<_>>()
        };
        let of_ra = |urn: &String| urn.starts_with("urn:jaus-rs:ra33:");
        assert!(!urns(Loader::catalogue).iter().any(of_ra));
        assert!(urns(Loader::reference_architecture).iter().all(of_ra));
    }

    #[test]
    fn definitions_are_found_by_set_and_by_identity() {
        assert!(sets().any(|set| set == "core"));
        let mut loader = Loader::new();
        loader.clients();
        for service in loader.load().library.services() {
            let entry = find(&service.id).expect("every service has a file");
            assert_eq!(entry.element, "service_def");
            assert!(entry.path.starts_with(entry.set));
        }
    }
}
