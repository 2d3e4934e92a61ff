//! `jaus jsidl check`: reports mistakes in definitions, with location and remedy.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted};
use jsidl::model::Location;
use jsidl::{Diagnostic, Loaded, Severity};
use serde_json::{Value, json};

use super::definitions::{load, load_strictly, own_findings, own_services, style};

/// Check service definitions: form, references, rules, state machines
///
/// Prints each finding with its position, the reason and the remedy. An error makes a definition
/// unusable; a warning does not. Exit status: 0 no error; 1 an error, or a warning with
/// --deny-warnings; 2 a path that does not exist.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl check my-services/\n  \
    jaus jsidl check --deny-warnings Lights.xml Types.xml\n  \
    jaus jsidl check --strict my-services/\n  \
    jaus jsidl check --json my-services/ | jq .message\n  \
    git show HEAD:Lights.xml | jaus jsidl check -")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; - is standard input
    ///
    /// They are checked together and may refer to each other, and to the built-in definitions.
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// Report also what a schema validator of the standard (AS5684) refuses
    ///
    /// That is the order of elements, missing mandatory elements and attributes, and values that
    /// the standard does not permit. `jaus jsidl fmt --strict` corrects most of it.
    #[arg(long)]
    strict: bool,

    /// Print each finding as one JSON object a line, without a summary
    #[arg(long)]
    json: bool,

    /// Fail on warnings as well
    #[arg(long)]
    deny_warnings: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let loaded = if arguments.strict {
        load_strictly(&arguments.paths)?
    } else {
        load(&arguments.paths)?
    };
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
    let services = own_services(loaded);
    let messages = services.clone().map(|s| s.messages().count()).sum();
    let usable = match (services.count(), messages) {
        (0, _) if errors == 0 => {
            "no service is defined here: a service is a file with the root element `service_def`"
                .to_owned()
        }
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
