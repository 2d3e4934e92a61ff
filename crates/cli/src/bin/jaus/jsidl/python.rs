//! `jaus jsidl python`: writes type stubs for the message classes of the Python package.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;

use super::sources;

/// Write type stubs for the message classes of the Python package
///
/// Writes one stub per set of services, such as example_lamps.pyi, for type checkers and editors. The
/// Python package makes the classes themselves from the definitions at run time
/// (`jaus.messages.load`), and has the stubs of the built-in definitions. Writes nothing if a
/// definition has errors.
#[derive(Args)]
#[command(after_help = "Example:\n  \
    jaus jsidl python my-services/ -o typings\n\n\
    The package does the same: python -m jaus.stubs my-services/ -o typings\n\n\
    Exit status: 0 written; 1 not written, because a definition has errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; without any, the built-in definitions
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let generate = |library: &_, wanted: &dyn Fn(&_) -> bool| jsidl::python::files(library, wanted);
    sources::generate(&arguments.paths, &arguments.output, generate)
}
