//! Last step before a part's program: `jaus` has the kernel end it when `jaus up` dies for any
//! reason, and then executes the program, which inherits this.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use nix::sys::prctl;
use nix::sys::signal::Signal;
use nix::unistd::getppid;

/// Our own program, even if its file has been replaced.
pub(super) const PROGRAM: &str = "/proc/self/exe";

/// Arguments before the part's program.
pub(super) fn arguments() -> [String; 3] {
    let parent = std::process::id().to_string();
    [NAME.to_owned(), parent, "--".to_owned()]
}

/// Name of the subcommand.
pub(crate) const NAME: &str = "up-leash";

/// Replace this process by a program that ends with its parent (internal to `jaus up`)
#[derive(Args)]
pub(crate) struct Leash {
    /// The expected parent process
    parent: i32,

    /// The program and its arguments
    #[arg(last = true, required = true, num_args = 1..)]
    command: Vec<OsString>,
}

impl Leash {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        // SIGTERM, so that a part can stop its devices and save data.
        prctl::set_pdeathsig(Signal::SIGTERM).map_err(Failure::of)?;
        if getppid().as_raw() != self.parent {
            // The parent died before the kernel had our request.
            return Ok(Outcome::Incomplete);
        }
        let Some((program, arguments)) = self.command.split_first() else {
            return Err(Failure::new("no program was given"));
        };
        // Returns only on an error.
        let error = Command::new(program).args(arguments).exec();
        jaus_cli::output::say(format_args!("{}: {error}", program.display()));
        Ok(Outcome::Incomplete)
    }
}
