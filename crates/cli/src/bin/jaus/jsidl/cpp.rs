//! `jaus jsidl cpp`: writes typed messages for C++17.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;

use super::sources;

/// Write messages as C++17 headers
///
/// Writes one header per set of services, such as jaus/core.hpp, and the codec that they share,
/// jaus/codec.hpp. They have no dependencies, and need no exceptions and no RTTI. Writes nothing if
/// a definition has errors.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl cpp -o include\n  \
    jaus jsidl cpp my-services/ -o include\n\n\
    In a program:\n\n  \
    #include \"jaus/mobility.hpp\"\n\n  \
    jaus::mobility::ReportGlobalPose pose;\n  \
    if (auto set = pose.set_latitude_deg(53.1); !set) std::puts(set.error().text().c_str());\n  \
    auto octets = jaus::codec::encode(pose);\n\n\
    Exit status: 0 written; 1 not written, because a definition has errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; without any, the built-in definitions
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to; the headers are in `jaus` below it
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let generate = |library: &_, wanted: &dyn Fn(&_) -> bool| jsidl::cpp::files(library, wanted);
    sources::generate(&arguments.paths, &arguments.output, generate)
}
