//! `jaus jsidl diff`: compares two sets of definitions and reports effects on the wire.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted};
use jsidl::diff::{Change, compare};
use jsidl::model::Location;
use jsidl::{Loaded, Severity, catalogue};
use serde_json::{Value, json};

use super::definitions::{complain, load, own_findings};

/// Compare two sets of service definitions and report wire incompatibilities
///
/// A change affects the wire if two programs, one built from each side, would misread or miss a
/// message. Such changes are marked with !. State machines are compared, descriptions are not. Exit
/// status: 0 the wire is unchanged; 1 it is affected; 2 a side cannot be read or has errors.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl diff old/Lights.xml new/Lights.xml\n  \
    jaus jsidl diff --json released-services/ my-services/ | jq 'select(.wire)'\n  \
    git show v1.0:Lights.xml | jaus jsidl diff - Lights.xml")]
pub(crate) struct Arguments {
    /// A JSIDL file, or a directory with `.xml`, `.csd` or `.cjsidl` files; - is standard input
    #[arg(value_name = "OLD")]
    old: PathBuf,

    /// The new version of OLD
    #[arg(value_name = "NEW")]
    new: PathBuf,

    /// Print each change as one JSON object a line, without a summary
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let old = sound(&arguments.old)?;
    let new = sound(&arguments.new)?;
    let own = |service: &jsidl::model::Service| !catalogue::holds(&service.location);
    let changes = compare(&old.library, &new.library, own);
    let wire = changes.iter().filter(|change| change.wire).count();
    let mut output = Output::new();
    if arguments.json {
        for change in &changes {
            output.line(to_json(change))?;
        }
    } else {
        print(&mut output, &changes)?;
        output.line(summary(changes.len(), wire))?;
    }
    Ok(ExitCode::from(u8::from(wire > 0)))
}

/// Loads a side. Definitions with errors cannot be compared and are an error.
fn sound(path: &Path) -> Result<Loaded, Failure> {
    let loaded = load(&[path.to_owned()])?;
    let findings = own_findings(&loaded);
    let errors: Vec<_> = findings
        .into_iter()
        .filter(|finding| finding.severity == Severity::Error)
        .collect();
    for error in &errors {
        complain(&loaded.diagnostics, error);
    }
    if errors.is_empty() {
        return Ok(loaded);
    }
    Err(Failure::new(format!(
        "{}: {}; correct that first, then compare",
        path.display(),
        counted(errors.len(), "error")
    )))
}

/// Prints the changes of each service under its name.
fn print(output: &mut Output, changes: &[Change]) -> Result<(), Failure> {
    let mut service = None;
    for change in changes {
        if service != Some(&change.service) {
            output.line(&change.service)?;
            service = Some(&change.service);
        }
        let mark = if change.wire { '!' } else { ' ' };
        let path = change.path.join(" / ");
        let colon = if path.is_empty() { "" } else { ": " };
        output.line(format_args!("{mark} {path}{colon}{change}"))?;
    }
    Ok(())
}

fn summary(changes: usize, wire: usize) -> String {
    match (changes, wire) {
        (0, _) => "no changes".to_owned(),
        (changes, 0) => format!("{}; the wire is unchanged", counted(changes, "change")),
        (changes, wire) => format!(
            "{}; the wire is affected by {wire} (marked with !)",
            counted(changes, "change")
        ),
    }
}

fn to_json(change: &Change) -> Value {
    let place = |location: &Option<Location>| {
        location.as_ref().map(|location| {
            json!({
                "file": location.file.display().to_string(),
                "line": location.line,
                "column": location.column,
            })
        })
    };
    json!({
        "service": change.service.to_string(),
        "path": change.path,
        "message": change.message,
        "wire": change.wire,
        "old": place(&change.old),
        "new": place(&change.new),
    })
}
