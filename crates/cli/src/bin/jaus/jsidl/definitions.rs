//! Loads the definitions of a subcommand and prints findings.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use jaus_cli::failure::Failure;
use jaus_cli::output::{colours_wanted, say_lines};
use jsidl::model::Service;
use jsidl::{Diagnostic, Diagnostics, Loaded, Loader, Style, catalogue};

/// The name of standard input among paths.
pub(crate) const STANDARD_INPUT: &str = "-";

/// Loads the definitions of these paths, which may refer to the built-in ones.
pub(crate) fn load(paths: &[PathBuf]) -> Result<Loaded, Failure> {
    load_with(Loader::new(), paths)
}

/// As [`load`], with all built-in client services.
pub(crate) fn load_with_clients(paths: &[PathBuf]) -> Result<Loaded, Failure> {
    let mut loader = Loader::new();
    loader.clients();
    load_with(loader, paths)
}

/// As [`load`], with a check against the letter of the standard.
pub(crate) fn load_strictly(paths: &[PathBuf]) -> Result<Loaded, Failure> {
    let mut loader = Loader::new();
    loader.strict();
    load_with(loader, paths)
}

fn load_with(mut loader: Loader, paths: &[PathBuf]) -> Result<Loaded, Failure> {
    for path in paths {
        if path == Path::new(STANDARD_INPUT) {
            loader.text("standard input", &standard_input()?);
            continue;
        }
        path.metadata()
            .map_err(|error| Failure::file(path, &error))?;
        loader.path(path);
    }
    loader.catalogue();
    Ok(loader.load())
}

pub(crate) fn standard_input() -> Result<String, Failure> {
    let mut text = String::new();
    io::stdin()
        .read_to_string(&mut text)
        .map_err(|error| Failure::new(format!("cannot read standard input: {error}")))?;
    Ok(text)
}

/// Findings in the user's own files. Consequences in built-in definitions are left out, as the user
/// cannot fix them there.
pub(crate) fn own_findings(loaded: &Loaded) -> Vec<&Diagnostic> {
    let findings = loaded.diagnostics.iter();
    findings
        .filter(|finding| !catalogue::holds(&finding.location))
        .collect()
}

/// Services of the user's own files.
pub(crate) fn own_services(loaded: &Loaded) -> impl Iterator<Item = &Arc<Service>> + Clone {
    let services = loaded.library.services();
    services.filter(|service| !catalogue::holds(&service.location))
}

/// Prints a finding on standard error. Errors are ignored.
pub(crate) fn complain(diagnostics: &Diagnostics, finding: &Diagnostic) {
    say_lines(diagnostics.excerpt(finding, style()));
}

/// Format of excerpts on this terminal.
pub(crate) fn style() -> Style {
    Style {
        colours: colours_wanted(&io::stdout()),
        width: terminal_size::terminal_size()
            .map_or(Style::default().width, |(width, _)| usize::from(width.0)),
    }
}
