//! `jaus jsidl schema`: writes the JSON view of messages as JSON Schema.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted};
use jsidl::schema;

use super::sources::{self, Sources};

/// Write JSON Schemas (draft 2020-12) of messages as `jaus decode` prints and `jaus encode` reads them
///
/// Writes one file per service. It accepts lines with the keys `message` and `body` that hold one
/// of the service's messages; the schema of a body alone is #/$defs/ plus the message's name.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl schema -o schemas\n  \
    jaus jsidl schema my-services/ -o schemas\n  \
    echo '00 2B 02' | jaus decode --hex > line.json\n  \
    check-jsonschema --schemafile schemas/core.Discovery.1.1.schema.json line.json\n\n\
    Exit status: 0 written; 1 written, without the definitions that have errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; without any, the built-in definitions
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Sources { loaded, sound } = sources::load(&arguments.paths)?;
    let wanted = sources::wanted(&loaded.library, &arguments.paths)?;
    let files = schema::files(&loaded.library, wanted);
    for (name, schema) in &files {
        sources::write(&arguments.output.join(name), &format!("{schema:#}\n"))?;
    }
    let count = counted(files.len(), "schema");
    Output::new().line(format_args!("{}: {count}", arguments.output.display()))?;
    Ok(ExitCode::from(u8::from(!sound)))
}
