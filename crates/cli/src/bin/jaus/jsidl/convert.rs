//! `jaus jsidl convert`: XML to the compact form of the language and back.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::{Output, counted, say};
use jsidl::{Diagnostics, Loader, Severity, format};

use super::definitions::{STANDARD_INPUT, complain, standard_input};
use super::sources::write;

/// Convert service definitions from XML to the compact form (CJSIDL), and back
///
/// The compact form is that of the JAUS Tool Set's editor, in files with the extension `.csd`; all
/// commands read it. What it cannot say is written into comments that the JAUS Tool Set skips and
/// this tool reads: `//@ name="value"` before a construct, and `/*@ … */` around XML. Back in XML,
/// references get their versions and constructs from the other files and from the built-in
/// definitions. Each result stands beside its source, with the other extension.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus jsidl convert my-services/\n  \
    jaus jsidl convert Lights.csd Types.csd -o xml/\n  \
    jaus jsidl convert - < Lights.xml\n\n\
    Exit status: 0 converted; 1 a file is not a definition, or has no counterpart; 2 a path cannot be read or written.")]
pub(crate) struct Arguments {
    /// JSIDL files, and directories with `.xml` and `.csd` files; - converts standard input to
    /// standard output
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,

    /// The directory to write to, instead of beside each source
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut run = Run {
        arguments,
        output: Output::new(),
        loader: Loader::new(),
        written: 0,
        is_faulty: false,
    };
    run.loader.catalogue().reference_architecture();
    for path in &arguments.paths {
        if path == Path::new(STANDARD_INPUT) {
            let text = standard_input()?;
            run.text(path, &text)?;
        } else if path.is_dir() {
            for file in jsidl::definition_files(path).map_err(Failure::new)? {
                run.file(&file)?;
            }
        } else {
            run.file(path)?;
        }
    }
    run.finish()
}

struct Run<'a> {
    arguments: &'a Arguments,
    output: Output,
    /// What texts in the compact form may refer to, and those texts.
    loader: Loader,
    written: usize,
    is_faulty: bool,
}

impl Run<'_> {
    fn file(&mut self, path: &Path) -> Result<(), Failure> {
        let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
        self.text(path, &text)
    }

    fn text(&mut self, path: &Path, text: &str) -> Result<(), Failure> {
        self.loader.text(path, text);
        if format::is_compact(path, text) {
            return Ok(());
        }
        match format::compact(path, text) {
            Ok(converted) => self.write(path, "csd", &converted),
            Err(findings) => {
                self.report(&findings);
                Ok(())
            }
        }
    }

    fn finish(mut self) -> Result<ExitCode, Failure> {
        let loader = std::mem::take(&mut self.loader);
        let (documents, findings) = loader.xml();
        self.report(&findings);
        for (path, document) in documents {
            self.write(&path, "xml", &document)?;
        }
        if self.written > 0 {
            say(format_args!("{} written", counted(self.written, "file")));
        }
        Ok(ExitCode::from(u8::from(self.is_faulty)))
    }

    fn report(&mut self, findings: &Diagnostics) {
        for finding in findings {
            self.is_faulty |= finding.severity == Severity::Error;
            complain(findings, finding);
        }
    }

    fn write(&mut self, source: &Path, extension: &str, text: &str) -> Result<(), Failure> {
        if source == Path::new(STANDARD_INPUT) {
            return self.output.part(text);
        }
        let mut target = source.with_extension(extension);
        if let (Some(folder), Some(name)) = (&self.arguments.output, target.file_name()) {
            target = folder.join(name);
        }
        if target.exists() && !self.arguments.force {
            let target = target.display();
            return Err(Failure::new(format!(
                "{target} exists: add --force to replace it, or name another directory"
            )));
        }
        write(&target, text)?;
        self.output.line(target.display())?;
        self.written += 1;
        Ok(())
    }
}
