//! `--jsidl` and `--service`: the definitions for reading and writing messages.

use std::path::PathBuf;

use clap::Args;
use jaus_cli::failure::Failure;
use jaus_cli::output::say;
use jaus_view::{Dictionary, ServiceName};
use jsidl::model::Id;
use jsidl::{Library, Loader};

/// `--jsidl`
#[derive(Args)]
pub(crate) struct Jsidl {
    /// Add the service definitions of a JSIDL file or directory (repeatable)
    ///
    /// They take precedence over the built-in ones. Errors are reported on standard error;
    /// definitions without errors are used.
    #[arg(long, value_name = "PATH")]
    jsidl: Vec<PathBuf>,
}

/// `--jsidl` and `--service`
#[derive(Args)]
pub(crate) struct Definitions {
    #[command(flatten)]
    jsidl: Jsidl,

    /// The service to prefer where several define the same message code (repeatable)
    ///
    /// A URN, or a URN and version: urn:jaus:jss:core:Events or urn:jaus:jss:core:Events@1.0
    #[arg(long, value_name = "URN")]
    service: Vec<String>,
}

/// All built-in message definitions.
fn built_in() -> Dictionary {
    Dictionary::of(jaus_vehicle::messages::registry())
        .with_reference_architecture(jaus_ra::messages::registry(), jaus_ra::forgiving::decode)
        .with_catalogue()
}

impl Definitions {
    /// Loads the built-in definitions and those of `--jsidl`.
    pub(crate) fn load(&self) -> Result<Dictionary, Failure> {
        let mut dictionary = self.jsidl.load()?;
        for service in &self.service {
            service
                .parse()
                .and_then(|service| dictionary.prefer(service))
                .map_err(|error| Failure::new(format!("--service {service}: {error}")))?;
        }
        Ok(dictionary)
    }

    /// Whether `--service` names this service, or nothing.
    pub(crate) fn chooses(&self, service: &Id) -> bool {
        let names = |name: &String| {
            name.parse()
                .is_ok_and(|it: ServiceName| it.matches(service))
        };
        self.service.is_empty() || self.service.iter().any(names)
    }
}

impl Jsidl {
    /// The files and directories.
    #[cfg(feature = "secure")]
    pub(crate) fn paths(&self) -> &[PathBuf] {
        &self.jsidl
    }

    /// Whether any definitions are given.
    pub(crate) const fn is_given(&self) -> bool {
        !self.jsidl.is_empty()
    }

    /// The messages of the built-in definitions and of `--jsidl`.
    pub(crate) fn load(&self) -> Result<Dictionary, Failure> {
        let mut dictionary = built_in();
        if self.jsidl.is_empty() {
            return Ok(dictionary);
        }
        let added = dictionary.load(&self.jsidl);
        for diagnostic in added.diagnostics.errors() {
            say(diagnostic);
        }
        if added.messages > 0 {
            return Ok(dictionary);
        }
        let paths = self.jsidl.iter().map(|path| path.display().to_string());
        let paths: Vec<_> = paths.collect();
        Err(Failure::new(format!(
            "no message definition could be loaded from {}",
            paths.join(", ")
        )))
    }

    /// The services of the built-in definitions and of `--jsidl`. [`load`](Self::load) reports what
    /// is wrong with them.
    pub(crate) fn services(&self) -> Library {
        let mut loader = Loader::new();
        for path in &self.jsidl {
            loader.path(path);
        }
        loader.catalogue();
        loader.load().library
    }
}
