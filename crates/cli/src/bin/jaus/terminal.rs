//! Secrets that are typed at the terminal, which does not show them.

use jaus_cli::failure::Failure;

/// Asks for a secret. The question goes to the terminal, also if standard output is a file.
pub(crate) fn ask(what: &str) -> Result<String, Failure> {
    rpassword::prompt_password(format!("{what}: "))
        .map_err(|error| Failure::new(format!("cannot read from the terminal: {error}")))
}

/// Asks for a new secret, twice.
pub(crate) fn ask_twice(what: &str) -> Result<String, Failure> {
    let secret = ask(what)?;
    if secret == ask("Again")? {
        Ok(secret)
    } else {
        Err(Failure::new("the two differ: try again"))
    }
}
