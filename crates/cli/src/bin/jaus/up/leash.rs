//! The last moment before a part's program begins: `jaus` asks the kernel to be ended when
//! `jaus up` dies, whatever it dies of, and then becomes the program, which inherits that.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use nix::sys::prctl;
use nix::sys::signal::Signal;
use nix::unistd::getppid;

/// Ourselves, also when our file has been replaced meanwhile.
pub(super) const PROGRAM: &str = "/proc/self/exe";

/// The arguments before the part's program.
pub(super) fn arguments() -> [String; 3] {
    let parent = std::process::id().to_string();
    [NAME.to_owned(), parent, "--".to_owned()]
}

/// The subcommand's name.
pub(crate) const NAME: &str = "up-leash";

/// Become another program that ends with its parent (for `jaus up` itself)
#[derive(Args)]
pub(crate) struct Leash {
    /// The process that must be our parent
    parent: i32,

    /// The program and its arguments
    #[arg(last = true, required = true, num_args = 1..)]
    command: Vec<OsString>,
}

impl Leash {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        // Politely: a part has things to stop and to write.
        prctl::set_pdeathsig(Signal::SIGTERM).map_err(Failure::of)?;
        if getppid().as_raw() != self.parent {
            // It died before the kernel knew of our wish.
            return Ok(Outcome::Incomplete);
        }
        let Some((program, arguments)) = self.command.split_first() else {
            return Err(Failure::new("there is no program to become"));
        };
        // Only an error comes back from this.
        let error = Command::new(program).args(arguments).exec();
        jaus_cli::output::say(format_args!("{}: {error}", program.display()));
        Ok(Outcome::Incomplete)
    }
}
