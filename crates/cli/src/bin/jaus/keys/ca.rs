//! `jaus keys ca`: the team's certificate authority.
#![expect(
    clippy::disallowed_methods,
    reason = "certificates are issued and revoked at the time of the host"
)]

mod passphrase;

use std::fmt::Display;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::{Args, Subcommand};
use jaus::address::JausId;
use jaus::node::units;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::folders::make_folder_of;
use jaus_cli::output::{Output, counted, say};
use jaus_cli::secure::KeyFiles;
use jaus_secure::ca::{CertificateAuthority, Issued, Request};
use jaus_secure::{DualControl, PublicKey};
use serde_json::json;

use super::Ids;
use super::approve::{Signer, list_waiting};
use crate::uptake::with_uptake;
use passphrase::{Change, Present, chosen};

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
    jaus keys ca revoke rover\n  \
    jaus keys ca passphrase")]
pub(super) struct Ca {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Make an authority: ca.key, encrypted, which stays here; ca.crt and ca.crl, which nodes need
    New(New),
    /// Issue a certificate and print it
    Issue(Issue),
    /// Approve a proposed certificate, issue and print it; or list those that wait
    Approve(Approve),
    /// Revoke the certificates of a node, and write the revocation list
    Revoke(Revoke),
    /// List the issued certificates
    List(List),
    /// Change the passphrase of ca.key, or encrypt a key that had none
    Passphrase(Change),
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

    /// Read the passphrase that encrypts ca.key from the first line of this file, such as /dev/stdin
    /// or <(pass show ca), instead of the terminal
    #[arg(long, value_name = "FILE", conflicts_with = "unencrypted")]
    passphrase_file: Option<PathBuf>,

    /// Leave the key unencrypted: anyone who copies the file can issue certificates
    #[arg(long)]
    unencrypted: bool,

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
    signer: Signer,

    #[command(flatten)]
    present: Present,
}

/// Approve a proposed certificate, issue and print it; or list those that wait
///
/// Where a file `approvers` stands in the folder of the authority, two of its people must sign what a
/// certificate allows: one by --sign with `jaus keys ca issue`, another one here. Nodes with the same file
/// beside their trusted keys accept no certificate without both. Revoking needs one alone.
#[derive(Args)]
struct Approve {
    /// The proposal to approve, as it is listed without this argument
    #[arg(requires = "sign")]
    proposal: Option<String>,

    #[command(flatten)]
    signer: Signer,

    #[command(flatten)]
    present: Present,
}

#[derive(Args)]
struct Revoke {
    /// The name of the node, for all its certificates; or the serial number of one
    #[arg(value_name = "NAME|SERIAL")]
    which: String,

    #[command(flatten)]
    present: Present,
}

#[derive(Args)]
struct List {
    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    folder: Folder,
}

/// The failure to read the files of an authority.
fn missing(error: impl Display) -> Failure {
    Failure::new(format!("{error}; `jaus keys ca new` makes an authority"))
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
            Action::Approve(it) => it.run(),
            Action::Revoke(it) => it.revoke(),
            Action::List(it) => it.list(),
            Action::Passphrase(it) => it.run(),
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

    /// The dual control of what it issues, if it is under that.
    fn control(&self) -> Result<Option<DualControl>, Failure> {
        let folder = self.path()?;
        let approvers = folder.join("approvers");
        let control = DualControl::new(&folder.join("issued"), &approvers);
        Ok(approvers.exists().then_some(control))
    }
}

impl New {
    fn make(&self) -> Result<Outcome, Failure> {
        let path = self.folder.path()?;
        make_folder_of(&path.join("ca.key"))?;
        let file = self.passphrase_file.as_deref();
        let passphrase = chosen(file, self.unencrypted, "--passphrase-file")?;
        let now = SystemTime::now();
        CertificateAuthority::create(&path, &self.name, passphrase.as_ref(), now)
            .map_err(Failure::of)?;
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
        if let Some(control) = self.present.folder.control()? {
            let line = request.line(SystemTime::now()).map_err(Failure::of)?;
            return self
                .signer
                .propose(&control, "jaus keys ca approve", &[line]);
        }
        let authority = self.present.open()?;
        let pem = authority
            .issue(&request, SystemTime::now())
            .map_err(Failure::of)?;
        Output::new().part(&pem)?;
        Ok(Outcome::Done)
    }
}

impl Approve {
    fn run(&self) -> Result<Outcome, Failure> {
        let Some(control) = self.present.folder.control()? else {
            return Err(Failure::new(
                "the authority is not under dual control: write those who approve into `approvers` in its folder",
            ));
        };
        let Some(id) = &self.proposal else {
            return list_waiting(&control);
        };
        let (key, now) = (self.signer.key()?, SystemTime::now());
        // Before it is signed, so that a wrong passphrase does not spend the approval.
        let authority = self.present.open()?;
        let approved = control.approve(id, &key, now).map_err(Failure::of)?;
        let pem = authority
            .issue_approved(&approved, now)
            .map_err(Failure::of)?;
        Output::new().part(&pem)?;
        Ok(Outcome::Done)
    }
}

impl Revoke {
    fn revoke(&self) -> Result<Outcome, Failure> {
        let list = self.present.folder.path()?.join("ca.crl");
        let authority = self.present.open()?;
        with_uptake(&list, || {
            let revoked = authority.revoke(&self.which, SystemTime::now());
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
        let issued = CertificateAuthority::issued(&self.folder.path()?).map_err(missing)?;
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
