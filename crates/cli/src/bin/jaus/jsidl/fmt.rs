//! `jaus jsidl fmt`: formats definitions.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted, say};
use jaus_files::Readers;
use jsidl::{Diagnostics, format};

use super::definitions::{STANDARD_INPUT, complain, standard_input};

/// Prefix of the JSIDL namespaces.
const NAMESPACE: &str = "urn:jaus:jsidl:";

/// Format service definitions: indentation, order of attributes, line width
///
/// Indents by two spaces, orders attributes and breaks lines at 116 characters; comments, texts and
/// meaning are kept. Each file is replaced atomically. Exit status: 0 all files are formatted; 1
/// with --check a file is not, or a file is not a definition; 2 a path cannot be read.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl fmt my-services/\n  \
    jaus jsidl fmt --check my-services/\n  \
    jaus jsidl fmt --strict my-services/\n  \
    jaus jsidl fmt - < Lights.xml")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml`, `.csd` or `.cjsidl` files; - formats standard input to standard output
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// Write what a schema validator of the standard (AS5684) accepts
    ///
    /// Adds mandatory attributes and elements that say nothing, and puts elements in order.
    /// `jaus jsidl check --strict` reports what is left to correct.
    #[arg(long)]
    strict: bool,

    /// Change nothing; list the files that would change
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut run = Run {
        check: arguments.check,
        layout: if arguments.strict {
            |path, text| format::strict(path, text)
        } else {
            |path, text| format::format(path, text)
        },
        output: Output::new(),
        changed: 0,
        same: 0,
        faulty: 0,
    };
    for path in &arguments.paths {
        if path == Path::new(STANDARD_INPUT) {
            run.standard_input()?;
        } else if path.is_dir() {
            let files = jsidl::definition_files(path).map_err(Failure::new)?;
            if files.is_empty() {
                say(format_args!("{} has no definitions", path.display()));
            }
            for file in files {
                run.file(&file, true)?;
            }
        } else {
            run.file(path, false)?;
        }
    }
    run.summary();
    let failed = run.faulty > 0 || (run.check && run.changed > 0);
    Ok(ExitCode::from(u8::from(failed)))
}

struct Run {
    check: bool,
    layout: fn(&Path, &str) -> Result<String, Diagnostics>,
    output: Output,
    changed: usize,
    same: usize,
    faulty: usize,
}

impl Run {
    fn standard_input(&mut self) -> Result<(), Failure> {
        let text = standard_input()?;
        match (self.layout)(Path::new("standard input"), &text) {
            Err(findings) => self.report(&findings),
            Ok(laid_out) if self.check => self.count(laid_out == text),
            Ok(laid_out) => self.output.part(&laid_out)?,
        }
        Ok(())
    }

    /// Formats a file. One that was `found` in a directory and is no definition is skipped.
    fn file(&mut self, path: &Path, found: bool) -> Result<(), Failure> {
        let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
        match (self.layout)(path, &text) {
            Err(_) if found && !text.contains(NAMESPACE) && !format::is_compact(path, &text) => {}
            Err(findings) => self.report(&findings),
            Ok(laid_out) if laid_out == text => self.count(true),
            Ok(laid_out) => {
                self.output.line(path.display())?;
                self.count(false);
                if !self.check {
                    replace(path, &laid_out).map_err(|error| Failure::file(path, &error))?;
                }
            }
        }
        Ok(())
    }

    fn count(&mut self, same: bool) {
        if same {
            self.same += 1;
        } else {
            self.changed += 1;
        }
    }

    fn report(&mut self, findings: &Diagnostics) {
        self.faulty += 1;
        for finding in findings {
            complain(findings, finding);
        }
    }

    fn summary(&self) {
        if self.changed + self.same == 0 {
            return;
        }
        let changed = counted(self.changed, "file");
        let what = if self.check {
            "to be formatted"
        } else {
            "formatted"
        };
        say(format_args!("{changed} {what}, {} unchanged", self.same));
    }
}

/// Replaces a file; of a link, the file that it leads to.
fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    jaus_files::replace(&fs::canonicalize(path)?, Readers::Everyone, text.as_bytes())
}
