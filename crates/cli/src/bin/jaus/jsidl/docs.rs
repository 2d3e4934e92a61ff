//! `jaus jsidl docs`: writes definitions as linked pages.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::Output;
use jsidl::docs::{Format, pages};

use super::sources::{self, Sources};

/// Write documentation of services: linked pages with the wire layout of every message
///
/// Writes one page per service, with its inheritance, messages and state machines, and an index by
/// set and by message code. The pages need no server: open index.html.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl docs -o built-in\n  \
    jaus jsidl docs my-services/ -o site\n  \
    jaus jsidl docs my-services/ -o docs/services --markdown\n\n\
    Exit status: 0 written; 1 written, without the definitions that have errors; 2 not written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; without any, the built-in definitions
    ///
    /// Includes pages of the built-in services that yours inherit from.
    #[arg(value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Write Markdown instead of HTML
    #[arg(long)]
    markdown: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let Sources { loaded, sound } = sources::load_with_clients(&arguments.paths)?;
    let format = if arguments.markdown {
        Format::Markdown
    } else {
        Format::Html
    };
    let wanted = sources::wanted(&loaded.library, &arguments.paths)?;
    let pages = pages(&loaded.library, wanted, format);
    for page in &pages {
        sources::write(&arguments.output.join(&page.path), &page.text)?;
    }
    let index = pages.first().map_or("", |page| &page.path);
    Output::new().line(format_args!(
        "{}: {} pages",
        arguments.output.join(index).display(),
        pages.len()
    ))?;
    Ok(ExitCode::from(u8::from(!sound)))
}
