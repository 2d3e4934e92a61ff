//! `jaus jsidl lua`: writes a Wireshark dissector for all loaded definitions.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::Output;
use jsidl::{Library, Loader};

use super::sources::{self, Sources};

/// The file's name in a directory.
const FILE: &str = "jaus.lua";

/// Write a Wireshark dissector (Lua) for the built-in definitions and your own
///
/// It dissects JAUS over UDP and TCP, reassembles large messages, and names every field
/// jaus.<message>.<field> in lower case. Messages of the Reference Architecture (OpenJAUS 3.x) are
/// recognised by their headers: jaus.ra.<message>.<field>. Where your definition and a built-in one
/// share a message code, yours takes precedence.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl lua -o ~/.local/lib/wireshark/plugins\n  \
    jaus jsidl lua my-services/ -o jaus.lua\n  \
    wireshark -X lua_script:jaus.lua drive.pcapng\n  \
    tshark -X lua_script:jaus.lua -r drive.pcapng -Y 'jaus.reportglobalpose.latitude > 53'\n\n\
    For ports other than 3794: Wireshark's Decode As, or tshark -d udp.port==5000,jaus\n\n\
    Exit status: 0 written; 1 written, without the definitions that have errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files
    #[arg(required_if_eq("only", "true"), value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The file to write, or a directory for jaus.lua; - is standard output
    #[arg(short, long, value_name = "FILE_OR_DIR", default_value = "-")]
    output: PathBuf,

    /// Omit the messages of the built-in definitions; yours may still refer to them
    #[arg(long)]
    only: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Sources { loaded, sound } = sources::load(&arguments.paths)?;
    let library = if arguments.only {
        sources::own(&loaded)
    } else {
        with_reference_architecture(loaded.library)
    };
    if arguments.only && library.services().next().is_none() {
        return Err(Failure::new(
            "no service is usable in these files; run `jaus jsidl check` to see why",
        ));
    }
    let script = jsidl::lua::dissector(&library);
    if arguments.output == Path::new("-") {
        Output::new().part(&script)?;
    } else {
        let path = file(&arguments.output);
        sources::write(&path, &script)?;
        let summary = sources::summary(&library);
        Output::new().line(format_args!("{}: {summary}", path.display()))?;
    }
    Ok(ExitCode::from(u8::from(!sound)))
}

fn with_reference_architecture(mut library: Library) -> Library {
    let mut loader = Loader::new();
    loader.reference_architecture();
    for service in loader.load().library.services() {
        library.insert(service.clone());
    }
    library
}

/// The output file: a directory, or a missing path without extension, gets a file inside.
fn file(output: &Path) -> PathBuf {
    let is_directory = output.is_dir() || (!output.exists() && output.extension().is_none());
    if is_directory {
        output.join(FILE)
    } else {
        output.to_owned()
    }
}
