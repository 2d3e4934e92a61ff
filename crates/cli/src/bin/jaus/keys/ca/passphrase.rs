//! The passphrase of the authority's key: where it is read, and how it is changed.

use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_files::Readers;
use jaus_secure::ca::CertificateAuthority;
use jaus_secure::{Key, Passphrase};

use super::{Folder, missing};
use crate::terminal::{ask, ask_twice};

/// The longest file with a passphrase, in octets.
const LONGEST: u64 = 4096;

/// An existing authority, and how its key is opened.
#[derive(Args)]
pub(super) struct Present {
    /// Read the passphrase of ca.key from the first line of this file, such as /dev/stdin or
    /// <(pass show ca), instead of the terminal
    #[arg(long, value_name = "FILE")]
    passphrase_file: Option<PathBuf>,

    #[command(flatten)]
    pub(super) folder: Folder,
}

impl Present {
    /// Opens the authority; asks for the passphrase if its key is encrypted.
    pub(super) fn open(&self) -> Result<CertificateAuthority, Failure> {
        let folder = self.folder.path()?;
        let key = CertificateAuthority::key_path(&folder);
        let passphrase = self.of(&key)?;
        if passphrase.is_none() {
            say(format_args!(
                "{} is not encrypted: whoever copies it can issue certificates; `jaus keys ca \
                 passphrase` encrypts it",
                key.display()
            ));
        }
        CertificateAuthority::open(&folder, passphrase.as_ref()).map_err(Failure::of)
    }

    /// The passphrase of a key file, if it is encrypted.
    fn of(&self, key: &Path) -> Result<Option<Passphrase>, Failure> {
        let is_sealed = Key::is_sealed(key).map_err(missing)?;
        match &self.passphrase_file {
            _ if !is_sealed => Ok(None),
            Some(file) => read(file).map(Some),
            None if io::stdin().is_terminal() => passphrase(ask("Passphrase")?).map(Some),
            None => Err(nobody("--passphrase-file")),
        }
    }
}

/// Change the passphrase of ca.key, or encrypt a key that had none
///
/// The key and its certificates stay the same.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys ca passphrase\n  \
    jaus keys ca passphrase --passphrase-file old.txt --new-passphrase-file new.txt\n  \
    jaus keys ca passphrase --unencrypted")]
pub(super) struct Change {
    #[command(flatten)]
    present: Present,

    /// Read the new passphrase from the first line of this file instead of the terminal
    #[arg(long, value_name = "FILE", conflicts_with = "unencrypted")]
    new_passphrase_file: Option<PathBuf>,

    /// Leave the key unencrypted: anyone who copies the file can issue certificates
    #[arg(long)]
    unencrypted: bool,
}

impl Change {
    pub(super) fn run(&self) -> Result<Outcome, Failure> {
        let key = CertificateAuthority::key_path(&self.present.folder.path()?);
        let old = self.present.of(&key)?;
        let file = self.new_passphrase_file.as_deref();
        let new = chosen(file, self.unencrypted, "--new-passphrase-file")?;
        Key::reseal(&key, old.as_ref(), new.as_ref()).map_err(Failure::of)?;
        let state = match new {
            Some(_) => {
                "encrypted with the new passphrase; copies of the file still have the old one"
            }
            None => "no longer encrypted",
        };
        say(format_args!("{} is {state}", key.display()));
        Ok(Outcome::Done)
    }
}

/// The passphrase for a new file, from the file that this flag names or from the terminal; `None` if the
/// key is to be unencrypted.
pub(super) fn chosen(
    file: Option<&Path>,
    unencrypted: bool,
    flag: &str,
) -> Result<Option<Passphrase>, Failure> {
    match file {
        _ if unencrypted => Ok(None),
        Some(file) => read(file).map(Some),
        None if io::stdin().is_terminal() => passphrase(ask_twice("New passphrase")?).map(Some),
        None => Err(nobody(&format!("{flag}, or --unencrypted"))),
    }
}

fn read(file: &Path) -> Result<Passphrase, Failure> {
    let text = jaus_files::read_text(file, Readers::Owner, LONGEST)
        .map_err(|error| Failure::file(file, &error))?;
    passphrase(text.lines().next().unwrap_or_default().to_owned())
}

fn passphrase(text: String) -> Result<Passphrase, Failure> {
    Passphrase::new(text.into()).map_err(Failure::of)
}

fn nobody(flags: &str) -> Failure {
    Failure::new(format!(
        "there is no terminal that could be asked for a passphrase: use {flags}"
    ))
}
