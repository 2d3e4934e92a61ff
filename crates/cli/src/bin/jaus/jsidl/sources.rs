//! Input definitions of generators, and their output files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted, say};
use jsidl::model::Service;
use jsidl::{Library, Loaded, Severity, catalogue};

use super::definitions;

/// Loaded definitions; findings are printed on standard error.
pub(super) struct Sources {
    pub(super) loaded: Loaded,
    /// Whether the user's own files have no errors.
    pub(super) sound: bool,
}

/// Loads files and directories, which may refer to each other and to the built-in definitions.
pub(super) fn load(paths: &[PathBuf]) -> Result<Sources, Failure> {
    Ok(Sources::of(definitions::load(paths)?))
}

/// As [`load`], with all built-in client services.
pub(super) fn load_with_clients(paths: &[PathBuf]) -> Result<Sources, Failure> {
    Ok(Sources::of(definitions::load_with_clients(paths)?))
}

impl Sources {
    fn of(loaded: Loaded) -> Self {
        let mut sound = true;
        for finding in definitions::own_findings(&loaded) {
            if finding.severity == Severity::Error {
                definitions::complain(&loaded.diagnostics, finding);
                sound = false;
            }
        }
        Self { loaded, sound }
    }
}

/// Services of the user's own files.
pub(super) fn own(loaded: &Loaded) -> Library {
    let mut own = Library::default();
    for service in definitions::own_services(loaded) {
        own.insert(service.clone());
    }
    own
}

/// Writes a file and creates its directories.
pub(super) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    if let Some(parent) = path
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty())
    {
        fs::create_dir_all(parent).map_err(|error| Failure::file(parent, &error))?;
    }
    fs::write(path, text).map_err(|error| Failure::file(path, &error))
}

/// Writes code in another language for the selected services, unless a definition has errors.
pub(super) fn generate(
    paths: &[PathBuf],
    output: &Path,
    files: impl Fn(&Library, &dyn Fn(&Service) -> bool) -> Vec<(String, String)>,
) -> Result<ExitCode, Failure> {
    let Sources { loaded, sound } = load(paths)?;
    if !sound {
        say("nothing was written: correct the definitions first (`jaus jsidl check` says more)");
        return Ok(ExitCode::from(1));
    }
    let wanted = wanted(&loaded.library, paths)?;
    let files = files(&loaded.library, &wanted);
    for (name, text) in &files {
        write(&output.join(name), text)?;
    }
    let count = counted(files.len(), "file");
    Output::new().line(format_args!("{}: {count}", output.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// For example `3 services with 14 messages`.
pub(super) fn summary(library: &Library) -> String {
    let messages = library.services().map(|s| s.messages().count()).sum();
    format!(
        "{} with {}",
        counted(library.services().count(), "service"),
        counted(messages, "message")
    )
}

/// The selected services: the user's own, or all if no paths are given.
pub(super) fn wanted<P>(
    library: &Library,
    paths: &[P],
) -> Result<impl Fn(&Service) -> bool + use<P>, Failure> {
    let all = paths.is_empty();
    let wanted = move |service: &Service| all || !catalogue::holds(&service.location);
    if library.services().any(|service| wanted(service)) {
        return Ok(wanted);
    }
    Err(Failure::new(
        "no service is usable in these files; run `jaus jsidl check` to see why",
    ))
}
