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
use jaus_cli::runtime;

use programs::Programs;
use system::System;

/// Start a whole system from a file, keep it running, and stop it cleanly
///
/// Every part is a process of its own. One that dies is started again, after a pause that grows with
/// each failure up to 30 s; one that says that its flags are wrong (exit status 2) is given up. Ctrl-C
/// or SIGTERM ends all, the last part first; a second one kills what is left.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus up packaging/system.toml          the whole vehicle on this machine\n  \
    jaus up system.toml --check            only says what would run, or what is wrong\n  \
    jaus up system.toml --only planner,knowledge-store\n  \
    jaus up system.toml --status /run/user/1000/jaus.json\n\n\
    Exit status: 0 all was stopped as wanted; 1 a part was given up or failed for good; 2 the file is wrong.",
    after_long_help = FILE_HELP)]
pub(crate) struct Up {
    /// What the system is; see below
    file: PathBuf,

    /// Only say what would be started, or what is wrong with the file
    #[arg(long)]
    check: bool,

    /// Start only these parts, by name
    #[arg(long, value_name = "PARTS", value_delimiter = ',')]
    only: Vec<String>,

    /// How many seconds a part may take to end before it is killed
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = runtime::seconds)]
    grace: Duration,

    /// Keep how the parts are in this file, as JSON
    #[arg(long, value_name = "FILE")]
    status: Option<PathBuf>,

    /// End after this time [default: at Ctrl-C]
    #[arg(long, value_parser = runtime::seconds)]
    seconds: Option<Duration>,
}

const FILE_HELP: &str = r#"Examples:
  jaus up packaging/system.toml          the whole vehicle on this machine
  jaus up system.toml --check            only says what would run, or what is wrong
  jaus up system.toml --only planner,knowledge-store
  jaus up system.toml --status /run/user/1000/jaus.json

The file is TOML:
  [all]                                  # for every part; a part's own settings win
  flags = { loopback = true }
  directory = "~/.local/state/jaus"      # where the parts run; made if it is not there
  environment = { JAUS_LOG = "info" }

  [parts.planner]                        # runs jaus-planner, from beside jaus or from PATH
  flags = { id = "101.3.36", peer = ["10.0.0.2", "10.0.0.3"], loopback = false }

  [parts.node]
  program = "jaus"                       # or a path; a relative one begins at the file
  arguments = ["node"]                   # as they are, before the flags
  restart = "on-failure"                 # or "always", which is usual, or "never"

Flags have their long names; true gives a flag without a value, false takes one of [all] away, a
list gives it several times. The order of the parts matters only for stopping: the last ends first.

When `jaus up` is killed itself, the kernel ends the parts (SIGTERM), and a second process of ours
ends what they have started, and kills after the grace what is still there. Only a program that
leaves its process group, or one that ignores SIGTERM when both of ours are killed, survives that.

Exit status: 0 all was stopped as wanted; 1 a part was given up or failed for good; 2 the file is
wrong."#;

impl Up {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let system = System::read(&self.file, &Programs::usual())?.only(&self.only)?;
        if self.check {
            return check::check(&self.file, &system);
        }
        runtime::run(run::run(self, system))
    }
}
