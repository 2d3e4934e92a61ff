//! `jaus keys ca`: the team's certificate authority.
#![expect(
    clippy::disallowed_methods,
    reason = "certificates are issued and revoked at the time of the host"
)]

use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::{Args, Subcommand};
use jaus::address::JausId;
use jaus::node::units;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::folders::make_folder_of;
use jaus_cli::output::{Output, counted, say};
use jaus_cli::secure::KeyFiles;
use jaus_secure::PublicKey;
use jaus_secure::ca::{CertificateAuthority, Issued, Request};
use serde_json::json;

use super::Ids;
use crate::uptake::with_uptake;

/// Seconds of a day.
const DAY: u64 = 24 * 60 * 60;

/// Issue and revoke certificates, instead of trusting each key on each host
///
/// A node with --certificate accepts every peer whose certificate is of the same authority. Its
/// private key never leaves its host: a certificate is issued for the public key that `jaus keys
/// show` prints there.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys ca new\n  \
    jaus keys ca issue rover WkE5vXW4lFyQ3nDzGnUlnQ0Xs0mB5bqkVHk0pJ1Yd2s= 101.255.255 > rover.crt\n  \
    jaus keys ca list\n  \
    jaus keys ca revoke rover")]
pub(super) struct Ca {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Make an authority: ca.key, which stays here; ca.crt and ca.crl, which nodes need
    New(New),
    /// Issue a certificate and print it
    Issue(Issue),
    /// Revoke the certificates of a node, and write the revocation list
    Revoke(Revoke),
    /// List the issued certificates
    List(List),
}

#[derive(Args)]
struct Folder {
    /// The folder of the authority [default: ~/.config/jaus/ca]
    #[arg(long, value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

#[derive(Args)]
struct New {
    /// The authority's name, without blanks
    #[arg(default_value = "jaus")]
    name: String,

    #[command(flatten)]
    folder: Folder,
}

#[derive(Args)]
struct Issue {
    /// The name of the node, without blanks
    name: String,

    /// Its public key, as `jaus keys show` prints it there
    #[arg(value_name = "KEY")]
    public_key: PublicKey,

    /// The ids that it may speak for, separated by commas: 101.255.255 for all of subsystem 101
    ids: Ids,

    /// How long the certificate is valid: days such as 30d, or a duration such as 12h
    #[arg(long = "for", value_name = "TIME", default_value = "30d", value_parser = life)]
    life: Duration,

    #[command(flatten)]
    folder: Folder,
}

#[derive(Args)]
struct Revoke {
    /// The name of the node, for all its certificates; or the serial number of one
    #[arg(value_name = "NAME|SERIAL")]
    which: String,

    #[command(flatten)]
    folder: Folder,
}

#[derive(Args)]
struct List {
    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    folder: Folder,
}

/// The life of a certificate.
fn life(text: &str) -> Result<Duration, String> {
    let days = text
        .strip_suffix('d')
        .and_then(|it| it.trim().parse::<u32>().ok());
    match days {
        Some(days) => Ok(Duration::from_secs(DAY * u64::from(days))),
        None => units::duration(text).map_err(|_| "write days such as 30d, or 12h".to_owned()),
    }
}

impl Ca {
    pub(super) fn run(&self) -> Result<Outcome, Failure> {
        match &self.action {
            Action::New(it) => it.make(),
            Action::Issue(it) => it.issue(),
            Action::Revoke(it) => it.revoke(),
            Action::List(it) => it.list(),
        }
    }
}

impl Folder {
    fn path(&self) -> Result<PathBuf, Failure> {
        match &self.folder {
            Some(path) => Ok(path.clone()),
            None => Ok(KeyFiles::folder()?.join("ca")),
        }
    }

    fn open(&self) -> Result<CertificateAuthority, Failure> {
        let open = CertificateAuthority::open(&self.path()?);
        open.map_err(|error| {
            Failure::new(format!("{error}; `jaus keys ca new` makes an authority"))
        })
    }
}

impl New {
    fn make(&self) -> Result<Outcome, Failure> {
        let path = self.folder.path()?;
        make_folder_of(&path.join("ca.key"))?;
        CertificateAuthority::create(&path, &self.name, SystemTime::now()).map_err(Failure::of)?;
        say(format_args!(
            "the authority is in {}; copy its ca.crt and ca.crl, never its ca.key, to each node",
            path.display()
        ));
        Ok(Outcome::Done)
    }
}

impl Issue {
    fn issue(&self) -> Result<Outcome, Failure> {
        let request = Request {
            name: self.name.clone(),
            key: self.public_key,
            ids: self.ids.0.clone(),
            life: self.life,
        };
        let authority = self.folder.open()?;
        let pem = authority
            .issue(&request, SystemTime::now())
            .map_err(Failure::of)?;
        Output::new().part(&pem)?;
        Ok(Outcome::Done)
    }
}

impl Revoke {
    fn revoke(&self) -> Result<Outcome, Failure> {
        let list = self.folder.path()?.join("ca.crl");
        with_uptake(&list, || {
            let revoked = self.folder.open()?.revoke(&self.which, SystemTime::now());
            let revoked = revoked.map_err(Failure::of)?;
            if revoked.is_empty() {
                return Err(Failure::negative(format!(
                    "no valid certificate has the name or serial number `{}`: see `jaus keys ca list`",
                    self.which
                )));
            }
            say(format_args!(
                "{} revoked; copy {} to each node",
                counted(revoked.len(), "certificate"),
                list.display()
            ));
            Ok(())
        })
    }
}

impl List {
    fn list(&self) -> Result<Outcome, Failure> {
        let issued = self.folder.open()?.issued().map_err(Failure::of)?;
        let (mut output, now) = (Output::new(), SystemTime::now());
        for it in &issued {
            let state = state(it, now);
            let ids: Vec<_> = it.ids.iter().map(JausId::to_string).collect();
            let (name, serial, end) = (&it.name, &it.serial, it.end());
            if self.json {
                let key = it.key.to_string();
                output.line(json!({
                    "name": name, "serial": serial, "key": key, "ids": ids, "until": end,
                    "state": state,
                }))?;
            } else {
                let ids = ids.join(",");
                output.line(format_args!("{name:16} {serial}  {end}  {state:8} {ids}"))?;
            }
        }
        Ok(Outcome::complete_if(!issued.is_empty()))
    }
}

fn state(issued: &Issued, now: SystemTime) -> &'static str {
    match issued.revoked {
        Some(_) => "revoked",
        None if issued.not_after <= now => "expired",
        None => "valid",
    }
}
