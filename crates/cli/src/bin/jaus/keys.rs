//! `jaus keys`: the key of this host's node, and the keys that it trusts.

use std::fs;

use clap::{Args, Subcommand};
use jaus::address::JausId;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::folders::make_folder_of;
use jaus_cli::output::{Output, say};
use jaus_cli::secure::KeyFiles;
use jaus_secure::{Key, Peer, PublicKey, Trust, edit};
use serde_json::json;

/// Make the key of this host's node, and choose the keys that it trusts
///
/// Nodes that trust each other's keys exchange messages over an authenticated, encrypted link; see
/// --secure-listen and --secure-peer. A running node notices a change of its trusted keys within
/// seconds.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys new\n  \
    jaus keys trust rover WkE5vXW4lFyQ3nDzGnUlnQ0Xs0mB5bqkVHk0pJ1Yd2s= 101.255.255\n  \
    jaus keys list\n  \
    jaus keys revoke rover")]
pub(crate) struct Keys {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Make a key, and print the command with which peers trust it
    New(Files),
    /// Print the public key
    Show(Files),
    /// Trust the key of a peer for these ids
    Trust(TrustKey),
    /// No longer trust a peer; its links to running nodes end
    Revoke(Revoke),
    /// List the trusted keys and the ids that they may speak for
    List(List),
}

#[derive(Args)]
struct Files {
    #[command(flatten)]
    files: KeyFiles,
}

#[derive(Args)]
struct TrustKey {
    /// A name for the peer, without blanks
    name: String,

    /// Its public key, as `jaus keys show` prints it there
    #[arg(value_name = "KEY")]
    public_key: PublicKey,

    /// The ids that it may speak for: 101.255.255 for all of subsystem 101
    #[arg(required = true)]
    ids: Vec<JausId>,

    #[command(flatten)]
    files: KeyFiles,
}

#[derive(Args)]
struct Revoke {
    /// The peer's name
    name: String,

    #[command(flatten)]
    files: KeyFiles,
}

#[derive(Args)]
struct List {
    /// Print JSON, one object on a line
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    files: KeyFiles,
}

impl Keys {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        match &self.action {
            Action::New(it) => it.make(),
            Action::Show(it) => it.show(),
            Action::Trust(it) => it.add(),
            Action::Revoke(it) => it.remove(),
            Action::List(it) => it.list(),
        }
    }
}

impl Files {
    fn make(&self) -> Result<Outcome, Failure> {
        let path = self.files.key()?;
        make_folder_of(&path)?;
        let key = Key::create(&path).map_err(Failure::of)?;
        say(format_args!(
            "the key is in {}; on each peer run: jaus keys trust NAME {} IDS",
            path.display(),
            key.public()
        ));
        Output::new().line(key.public())?;
        Ok(Outcome::Done)
    }

    fn show(&self) -> Result<Outcome, Failure> {
        let key = Key::load(&self.files.key()?).map_err(Failure::of)?;
        Output::new().line(key.public())?;
        Ok(Outcome::Done)
    }
}

impl TrustKey {
    fn add(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        make_folder_of(&path)?;
        let peer = Peer {
            name: self.name.clone(),
            key: self.public_key,
            ids: self.ids.clone(),
        };
        edit::trust(&path, &peer).map_err(Failure::of)?;
        Ok(Outcome::Done)
    }
}

impl Revoke {
    fn remove(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        if edit::revoke(&path, &self.name).map_err(Failure::of)? {
            return Ok(Outcome::Done);
        }
        Err(Failure::negative(format!(
            "`{}` is not in {}: see `jaus keys list`",
            self.name,
            path.display()
        )))
    }
}

impl List {
    fn list(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        let text = fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
        let trust = Trust::parse(&text).map_err(Failure::of)?;
        let mut output = Output::new();
        for peer in trust.peers() {
            let ids: Vec<_> = peer.ids.iter().map(JausId::to_string).collect();
            if self.json {
                let key = peer.key.to_string();
                output.line(json!({ "name": peer.name, "key": key, "ids": ids }))?;
            } else {
                output.line(format_args!(
                    "{:16} {}  {}",
                    peer.name,
                    peer.key,
                    ids.join(", ")
                ))?;
            }
        }
        Ok(Outcome::complete_if(!trust.peers().is_empty()))
    }
}
