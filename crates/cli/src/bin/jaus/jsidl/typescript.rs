//! `jaus jsidl typescript`: writes typed messages for pages and Node.js.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;

use super::sources;

/// Write messages as JavaScript modules with TypeScript declarations
///
/// Writes one module per set of services, such as core.js with core.d.ts, and the codec that they
/// share, codec.js. They run in pages and in Node.js without dependencies and without a build step.
/// Writes nothing if a definition has errors.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl typescript -o src/jaus\n  \
    jaus jsidl typescript my-services/ -o src/messages\n\n\
    In a module:\n\n  \
    import { ReportGlobalPose } from \"./jaus/mobility.js\";\n  \
    const octets = new ReportGlobalPose({ latitudeDeg: 53.1 }).encode();\n  \
    console.log(ReportGlobalPose.decode(octets).latitudeDeg);\n\n\
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
    let generate =
        |library: &_, wanted: &dyn Fn(&_) -> bool| jsidl::typescript::files(library, wanted);
    sources::generate(&arguments.paths, &arguments.output, generate)
}
