//! `jaus jsidl`: works on service definitions, one file per subcommand.

mod check;
mod convert;
mod cpp;
mod datagram;
mod definitions;
mod diff;
mod docs;
mod explain;
mod fmt;
mod lua;
mod msg;
mod python;
mod ra;
mod rust;
mod schema;
mod sources;
mod typescript;

use std::process::ExitCode;

use clap::{Args, Subcommand};
use jaus_cli::failure::Failure;

/// Check, compare and format service definitions (JSIDL), and generate code, docs and schemas
#[derive(Args)]
#[command(after_help = "Start with `jaus jsidl check my-services/`.\n\n\
    Definitions may refer to all built-in definitions without listing their files.")]
pub(crate) struct Jsidl {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Check(check::Arguments),
    Fmt(fmt::Arguments),
    Convert(convert::Arguments),
    Diff(diff::Arguments),
    Rust(rust::Arguments),
    Cpp(cpp::Arguments),
    #[command(name = "typescript")]
    TypeScript(typescript::Arguments),
    Python(python::Arguments),
    Msg(msg::Arguments),
    Lua(lua::Arguments),
    Docs(docs::Arguments),
    Schema(schema::Arguments),
    Explain(explain::Arguments),
}

impl Jsidl {
    pub(crate) fn run(self) -> Result<ExitCode, Failure> {
        match self.command {
            Command::Check(arguments) => check::run(&arguments),
            Command::Fmt(arguments) => fmt::run(&arguments),
            Command::Convert(arguments) => convert::run(&arguments),
            Command::Diff(arguments) => diff::run(&arguments),
            Command::Rust(arguments) => rust::run(&arguments),
            Command::Cpp(arguments) => cpp::run(&arguments),
            Command::TypeScript(arguments) => typescript::run(&arguments),
            Command::Python(arguments) => python::run(&arguments),
            Command::Msg(arguments) => msg::run(&arguments),
            Command::Lua(arguments) => lua::run(&arguments),
            Command::Docs(arguments) => docs::run(&arguments),
            Command::Schema(arguments) => schema::run(&arguments),
            Command::Explain(arguments) => explain::run(&arguments),
        }
    }
}
