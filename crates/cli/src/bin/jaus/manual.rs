//! `jaus completions`, `jaus man` and `jaus reference`: the files that shells, `man` and the book
//! read, from the definition of the command line.

use std::fs;
use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::Output;
use jaus_cli::reference;

/// Print the completions for a shell
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus completions bash > ~/.local/share/bash-completion/completions/jaus\n  \
    jaus completions zsh > ~/.zfunc/_jaus          with ~/.zfunc in fpath\n  \
    jaus completions fish > ~/.config/fish/completions/jaus.fish")]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the completions of this command line.
    pub(crate) fn run(&self, mut command: Command) -> Result<Outcome, Failure> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut command, "jaus", &mut text);
        let text = String::from_utf8(text).map_err(Failure::of)?;
        Output::new().part(&text)?;
        Ok(Outcome::Done)
    }
}

/// Write the manual pages, one for each command
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus man ~/.local/share/man/man1\n  \
    man jaus-query")]
pub(crate) struct Man {
    /// The directory of the pages; it is created if it is missing
    directory: PathBuf,
}

impl Man {
    /// Writes the pages of this command line.
    pub(crate) fn run(&self, command: Command) -> Result<Outcome, Failure> {
        let failure = |error| Failure::file(&self.directory, &error);
        fs::create_dir_all(&self.directory).map_err(failure)?;
        clap_mangen::generate_to(command, &self.directory).map_err(failure)?;
        Ok(Outcome::Done)
    }
}

/// Print the page of the commands in the book
#[derive(Args)]
pub(crate) struct Reference;

impl Reference {
    /// Prints the page of this command line.
    pub(crate) fn run(&self, command: Command) -> Result<Outcome, Failure> {
        reference::print(command, Command::new(""))?;
        Ok(Outcome::Done)
    }
}
