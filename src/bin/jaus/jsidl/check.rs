//! `jaus jsidl check`: what is wrong with definitions, where, and what to do about it.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus::cli::failure::Failure;
use jaus::cli::output::{Output, colours_wanted};
use jsidl::model::{Location, Service};
use jsidl::{Diagnostic, Loaded, Loader, Severity, Style, catalogue};
use serde_json::{Value, json};

/// Check service definitions: form, references, rules, state machines
///
/// All findings are printed, each with its place, the reason and what to do. An error makes a
/// definition unusable; a warning does not. Exit status: 0 no error; 1 an error, or a warning with
/// --deny-warnings; 2 a path that does not exist.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl check my-services/\n  \
    jaus jsidl check --deny-warnings Lights.xml Types.xml\n  \
    jaus jsidl check --json my-services/ | jq .message\n  \
    git show HEAD:Lights.xml | jaus jsidl check -")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml` files; - is standard input
    ///
    /// They are checked together and may refer to each other, and to the built-in definitions.
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// Print every finding as one JSON object a line, and no summary
    #[arg(long)]
    json: bool,

    /// Fail on warnings as well
    #[arg(long)]
    deny_warnings: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let loaded = load(&arguments.paths)?;
    let findings = own_findings(&loaded);
    let mut output = Output::new();
    for finding in &findings {
        if arguments.json {
            output.line(to_json(finding))?;
        } else {
            output.line(loaded.diagnostics.excerpt(finding, style()))?;
        }
    }
    let count = |severity| findings.iter().filter(|f| f.severity == severity).count();
    let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
    if !arguments.json {
        output.line(summary(&loaded, errors, warnings))?;
    }
    let failed = errors > 0 || (arguments.deny_warnings && warnings > 0);
    Ok(ExitCode::from(u8::from(failed)))
}

/// The definitions of these paths, which may refer to the built-in ones.
fn load(paths: &[PathBuf]) -> Result<Loaded, Failure> {
    let mut loader = Loader::new();
    for path in paths {
        if path == Path::new("-") {
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

fn standard_input() -> Result<String, Failure> {
    let mut text = String::new();
    io::stdin()
        .read_to_string(&mut text)
        .map_err(|error| Failure::new(format!("cannot read standard input: {error}")))?;
    Ok(text)
}

/// What is found in the user's own files. Built-in definitions may suffer from them, but that is
/// not what the user can mend.
fn own_findings(loaded: &Loaded) -> Vec<&Diagnostic> {
    let findings = loaded.diagnostics.iter();
    findings
        .filter(|finding| !catalogue::holds(&finding.location))
        .collect()
}

fn style() -> Style {
    Style {
        colours: colours_wanted(&io::stdout()),
        width: terminal_size::terminal_size()
            .map_or(Style::default().width, |(width, _)| usize::from(width.0)),
    }
}

fn to_json(finding: &Diagnostic) -> Value {
    let place = |location: &Location, message: &str| {
        json!({
            "file": location.file.display().to_string(),
            "line": location.line,
            "column": location.column,
            "message": message,
        })
    };
    let mut object = place(&finding.location, &finding.message);
    object["severity"] = finding.severity.to_string().into();
    let notes = finding.notes.iter();
    object["notes"] = notes
        .map(|note| place(&note.location, &note.message))
        .collect();
    object
}

/// For example `1 error, no warnings; 3 services with 14 messages are usable`.
fn summary(loaded: &Loaded, errors: usize, warnings: usize) -> String {
    let own = |service: &&std::sync::Arc<Service>| !catalogue::holds(&service.location);
    let services = loaded.library.services().filter(own);
    let messages = services.clone().map(|s| s.messages().count()).sum();
    let usable = match (services.count(), messages) {
        (0, _) if errors == 0 => "these files define no service".to_owned(),
        (0, _) => "no service is usable".to_owned(),
        (services, messages) => format!(
            "{} with {} {} usable",
            counted(services, "service"),
            counted(messages, "message"),
            if services == 1 { "is" } else { "are" }
        ),
    };
    let (errors, warnings) = (counted(errors, "error"), counted(warnings, "warning"));
    format!("{errors}, {warnings}; {usable}")
}

fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}
