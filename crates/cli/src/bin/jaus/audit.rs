//! `jaus audit`: verifies audit logs.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use jaus_audit::{VerifiedLog, refusals_of, verify};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};

/// Verify audit logs
///
/// Each line of an audit log has a number, and the hash (SHA-256) of the whole line before it.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus audit verify /var/log/jaus/audit.jsonl\n  \
    jaus audit verify /var/log/jaus/audit.jsonl --noted 1042:9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08\n\n\
    Exit status: 0 no line was changed or is missing, as far as the log tells; 1 one was changed or is \
    missing; 2 a file cannot be read.")]
pub(crate) struct AuditCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Find the first line that was changed or is missing, also in full files
    ///
    /// The log itself cannot tell whether its last lines were cut off, or its oldest files removed, nor
    /// whether someone wrote all of it anew. For that, note the last number and hash that this command
    /// prints somewhere else, or forward the entries to another host, and compare them by --noted: each
    /// forwarded entry has its number and hash. A torn line, such as after a loss of power, is no break.
    Verify(Verify),
}

#[derive(Args)]
struct Verify {
    /// The audit log; its full files and its refusals are verified, too
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,

    /// The last line that an earlier verification has printed, or a forwarded one: the log must still have it
    #[arg(long, value_name = "NUMBER:HASH")]
    noted: Option<Noted>,
}

/// The number and the hash of a line.
#[derive(Clone)]
struct Noted(u64, String);

impl std::str::FromStr for Noted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let noted = text.split_once(':').and_then(|(number, hash)| {
            let is_hash = hash.len() == 64 && hash.bytes().all(|it| it.is_ascii_hexdigit());
            let number = number.parse().ok().filter(|_| is_hash)?;
            Some(Self(number, hash.to_ascii_lowercase()))
        });
        noted.ok_or_else(|| {
            "write the number and the hash that `jaus audit verify` has printed".to_owned()
        })
    }
}

impl AuditCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let Action::Verify(it) = &self.action;
        it.run()
    }
}

impl Verify {
    fn run(&self) -> Result<Outcome, Failure> {
        let noted = self
            .noted
            .as_ref()
            .map(|Noted(number, hash)| (*number, &**hash));
        let (mut outcome, mut output) = (Outcome::Done, Output::new());
        for file in &self.files {
            let refusals = refusals_of(file);
            let has_refusals = refusals.exists();
            // What was noted is a line of the named file.
            let logs = std::iter::once((&**file, noted));
            for (file, noted) in logs.chain(has_refusals.then_some((&*refusals, None))) {
                match verify(file, noted) {
                    Ok(log) => tell(&mut output, file, &log)?,
                    Err(error @ jaus_audit::VerifyError::File { .. }) => {
                        return Err(Failure::of(error));
                    }
                    Err(error) => {
                        say(error);
                        outcome = Outcome::Incomplete;
                    }
                }
            }
        }
        Ok(outcome)
    }
}

/// Says what is there, and what is not.
fn tell(output: &mut Output, file: &Path, log: &VerifiedLog) -> Result<(), Failure> {
    let (file, first, last) = (file.display(), log.first, log.last);
    if last == 0 {
        output.line(format_args!("{file}: no lines"))?;
    } else {
        output.line(format_args!(
            "{file}: lines {first} to {last} are unchanged; the last is {last}:{}",
            log.hash
        ))?;
    }
    if first > 1 {
        let before = first - 1;
        output.line(format_args!(
            "{file}: lines 1 to {before} were in older files, which are gone"
        ))?;
    }
    for (file, line) in &log.torn {
        output.line(format_args!(
            "{}:{line}: this line is torn: the program was interrupted while it wrote it",
            file.display()
        ))?;
    }
    Ok(())
}
