//! `--jsidl` and `--service`: which definitions messages are read and written by.

use clap::Args;
use jaus::view::Dictionary;

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Definitions {
    /// The service meant where several define the same message code (repeatable)
    ///
    /// A URN, or a URN and version: urn:jaus:jss:core:Events or urn:jaus:jss:core:Events@1.0
    #[arg(long, value_name = "URN")]
    service: Vec<String>,
}

impl Definitions {
    /// The built-in definitions and those of `--jsidl`.
    pub(crate) fn load(&self) -> Result<Dictionary, Failure> {
        let mut dictionary = Dictionary::new();
        for service in &self.service {
            service
                .parse()
                .and_then(|service| dictionary.prefer(service))
                .map_err(|error| Failure::new(format!("--service {service}: {error}")))?;
        }
        Ok(dictionary)
    }
}
