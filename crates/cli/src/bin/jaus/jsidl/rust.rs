//! `jaus jsidl rust`: writes typed messages of a user's services.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, say};
use jsidl::model::Service;
use jsidl::rust::Settings;

use super::sources::{self, Sources};

/// Write the messages of your services as a Rust module
///
/// The messages of the built-in services are in the crate `jaus`; yours may refer to them. Writes
/// nothing if a definition has errors.
#[derive(Args)]
#[command(after_help = "Example:\n  \
    jaus jsidl rust services/ -o src\n\n\
    In a crate that depends on `jaus`, add:\n\n  \
    mod messages;\n\n\
    Or generate it at build time, with the crate `jsidl` as a build dependency and this \
    build.rs:\n\n  \
    fn main() {\n      \
        jsidl::build::Build::new().path(\"services\").module(\"messages\", \"urn:example:\").run();\n  \
    }\n\n\
    and include the messages:\n\n  \
    pub mod messages {\n      \
        include!(concat!(env!(\"OUT_DIR\"), \"/messages.rs\"));\n  \
    }\n\n\
    Exit status: 0 written; 1 not written, because a definition has errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// The name of the module and its file
    #[arg(long, value_name = "NAME", default_value = "messages", value_parser = module)]
    module: String,

    /// The path of the codec runtime in the generated code
    #[arg(long, value_name = "RUST_PATH", default_value = "::jaus::codec")]
    runtime: String,

    /// The path of the module with the messages of services whose URN begins with URN, such as
    /// urn:jaus:jss:core:=::jaus::messages::core; state machines then get these messages as their types
    #[arg(long, value_name = "URN=RUST_PATH", value_parser = extern_path)]
    extern_path: Vec<ExternPath>,
}

/// A module of generated messages elsewhere.
#[derive(Debug, Clone)]
struct ExternPath {
    urn: String,
    path: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Sources { loaded, sound } = sources::load(&arguments.paths)?;
    if !sound {
        say("nothing was written: correct the definitions first (`jaus jsidl check` says more)");
        return Ok(ExitCode::from(1));
    }
    let library = sources::own(&loaded);
    if library.services().next().is_none() {
        return Err(Failure::new("these files define no service"));
    }
    let services = library.services().map(AsRef::<Service>::as_ref);
    let mut settings = Settings::new(&arguments.runtime);
    for ExternPath { urn, path } in &arguments.extern_path {
        settings = settings.extern_path(urn, path);
    }
    let text = jsidl::rust::module_with(&loaded.library, services, &settings);
    let path = arguments.output.join(format!("{}.rs", arguments.module));
    sources::write(&path, &text)?;
    let summary = sources::summary(&library);
    Output::new().line(format_args!("{}: {summary}", path.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Parses the beginning of a URN and a path.
fn extern_path(text: &str) -> Result<ExternPath, String> {
    let expected = "expected URN=RUST_PATH, such as urn:jaus:jss:core:=::jaus::messages::core";
    let (urn, path) = text.split_once('=').ok_or(expected)?;
    if urn.is_empty() || path.is_empty() {
        return Err(expected.to_owned());
    }
    Ok(ExternPath {
        urn: urn.to_owned(),
        path: path.to_owned(),
    })
}

/// Parses a module name.
fn module(name: &str) -> Result<String, String> {
    let starts_well = name.starts_with(|c: char| c.is_ascii_lowercase() || c == '_');
    let goes_on_well = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if starts_well && name.chars().all(goes_on_well) {
        Ok(name.to_owned())
    } else {
        Err("a module name consists of lower-case letters, digits and _".to_owned())
    }
}
