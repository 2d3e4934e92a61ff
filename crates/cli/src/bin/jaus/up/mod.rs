//! `jaus up`: runs a whole system as processes of one machine.

mod check;
mod child;
mod console;
pub(crate) mod leash;
mod programs;
mod run;
mod status;
mod supervisor;
mod system;
pub(crate) mod warden;

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::runtime::{self, RunFor};

use programs::Programs;
use system::System;

/// Start a system of programs from a file, supervise it, and stop it cleanly
///
/// Every part is a process. A part that dies is restarted, after a delay that grows with each
/// failure up to 30 s; a part that reports wrong flags (exit status 2) is given up. Ctrl-C or
/// SIGTERM stops all parts in reverse order; a second one kills the rest.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus up packaging/system.toml          the whole vehicle on this machine\n  \
    jaus up system.toml --check            only checks the file and prints what would run\n  \
    jaus up system.toml --only planner,knowledge-store\n  \
    jaus up system.toml --status /run/user/1000/jaus.json\n\n\
    Exit status: 0 stopped on request; 1 a part was given up or failed for good; 2 the file is \
    wrong.",
    after_long_help = FILE_HELP)]
pub(crate) struct Up {
    /// The system's file; see below
    file: PathBuf,

    /// Check the file and print what would be started
    #[arg(long)]
    check: bool,

    /// Start only these parts, by name
    #[arg(long, value_name = "PARTS", value_delimiter = ',')]
    only: Vec<String>,

    /// How long a part may take to end before it is killed
    #[arg(long, value_name = "DURATION", default_value = "5s", value_parser = runtime::duration)]
    grace: Duration,

    /// Write the state of the parts to this file, as JSON
    #[arg(long, value_name = "FILE")]
    status: Option<PathBuf>,

    #[command(flatten)]
    run_for: RunFor,
}

const FILE_HELP: &str = r#"Examples:
  jaus up packaging/system.toml          the whole vehicle on this machine
  jaus up system.toml --check            only checks the file and prints what would run
  jaus up system.toml --only planner,knowledge-store
  jaus up system.toml --status /run/user/1000/jaus.json

The file is TOML:
  [all]                                  # for all parts; a part's own settings take precedence
  flags = { loopback = true }
  directory = "~/.local/state/jaus"      # where the parts run; created if missing
  environment = { JAUS_LOG = "info" }

  [parts.planner]                        # runs jaus-planner, beside jaus or in PATH
  flags = { id = "101.3.36", peer = ["10.0.0.2", "10.0.0.3"], loopback = false }

  [parts.node]
  program = "jaus"                       # or a path, relative to this file
  arguments = ["node"]                   # passed unchanged, before the flags
  restart = "on-failure"                 # or "always" (the default) or "never"

Flags have their long names; true gives a flag without a value, false takes one of [all] away, a
list gives it several times. The order of the parts matters only for stopping: the last ends first.

If `jaus up` itself is killed, the kernel sends SIGTERM to the parts, and a second process of
`jaus up` ends their children and kills the rest after the grace period. A program survives
only if it leaves its process group, or ignores SIGTERM and both processes are killed.

Exit status: 0 stopped on request; 1 a part was given up or failed for good; 2 the file is wrong."#;

impl Up {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let system = System::read(&self.file, &Programs::usual())?.only(&self.only)?;
        if self.check {
            return check::check(&self.file, &system);
        }
        runtime::run(run::run(self, system))
    }
}
