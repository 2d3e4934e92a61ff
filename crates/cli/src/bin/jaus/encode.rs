//! `jaus encode`: JSON lines to lines of hex.

use std::io::{self, BufRead};

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::Output;
use jaus_view::{Dictionary, Line, Request, Unreadable, to_hex};

use crate::definitions::Definitions;

/// Encode JSON lines from standard input to messages, printed in hex
///
/// A line has "message" (the name) or "code", "body", and optionally "service", as printed by `jaus
/// decode`. For a line that cannot be encoded, its line holds {"error":…,"offset":…}. Encoding
/// continues, and the exit status is 1.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    echo '{\"message\":\"QueryIdentification\",\"body\":{\"QueryType\":2}}' | jaus encode\n  \
    jaus decode --hex < messages.txt | jaus encode")]
pub(crate) struct Encode {
    /// Encode by the definitions of the Reference Architecture (RA 3.x, OpenJAUS 3.x) where no
    /// "service" is given
    #[arg(long)]
    ra: bool,

    #[command(flatten)]
    definitions: Definitions,
}

impl Encode {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let mut dictionary = self.definitions.load()?;
        if self.ra {
            dictionary.prefer_reference_architecture();
        }
        let mut output = Output::new();
        let mut complete = true;
        for line in io::stdin().lock().lines() {
            let line = line.map_err(|error| {
                Failure::new(format!(
                    "cannot read JSON lines from standard input: {error}"
                ))
            })?;
            if line.trim().is_empty() {
                continue;
            }
            match encode(&dictionary, &line) {
                Ok(hex) => output.line(hex)?,
                Err(error) => {
                    complete = false;
                    let offset = error.offset as u64;
                    output.line(Line::of_error(None, &error, offset).to_json())?;
                }
            }
        }
        Ok(Outcome::complete_if(complete))
    }
}

fn encode(dictionary: &Dictionary, line: &str) -> Result<String, Unreadable> {
    let octets = dictionary.write(&Request::from_json(line)?)?;
    Ok(to_hex(&octets))
}
