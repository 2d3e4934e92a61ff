//! The report whether running services have taken a change of their file.

use std::path::Path;

use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_files::{FormerContent, Uptake};

/// Changes a file, waits for the services that use it, and reports whether they have taken the change.
///
/// # Errors
/// Those of `change`; and a negative result if a service still uses the former content.
pub(crate) fn with_uptake(
    path: &Path,
    change: impl FnOnce() -> Result<(), Failure>,
) -> Result<Outcome, Failure> {
    let former = FormerContent::of(path);
    change()?;
    let file = path.display();
    match former.uptake() {
        Uptake::New => {}
        Uptake::Unused => say(format_args!("no running service uses {file}")),
        Uptake::Complete => say(format_args!(
            "the services that use {file} have taken the change"
        )),
        Uptake::Incomplete(processes) => {
            let names: Vec<_> = processes.iter().map(ToString::to_string).collect();
            let who = match names.is_empty() {
                true => "a service that cannot be seen from here".to_owned(),
                false => names.join(", "),
            };
            return Err(Failure::negative(format!(
                "{file} is changed, but after 2 s its former content is still used by {who}: read the log \
                 there, then mend, restart or stop it"
            )));
        }
        Uptake::Unknown(error) => {
            return Err(Failure::negative(format!(
                "{file} is changed, but whether running services have taken it cannot be confirmed here \
                 ({error}): read their logs, or restart them"
            )));
        }
    }
    Ok(Outcome::Done)
}
