//! `jaus keys`: the key of this host's node, the keys that it trusts, and the team's certificates.

mod approve;
mod ca;
mod explain;
mod rotate;

use std::fs;
use std::path::Path;
use std::str::FromStr;

use clap::{Args, Subcommand};
use jaus::address::JausId;
use jaus::rights::Rules;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::folders::make_folder_of;
use jaus_cli::output::{Output, say};
use jaus_cli::permissions::table_with;
use jaus_cli::secure::KeyFiles;
use jaus_secure::{Grant, Key, Peer, PublicKey, Trust, edit};
use serde_json::json;

use crate::definitions::Jsidl;
use crate::uptake::with_uptake;

/// Make the key of this host's node, and choose the keys that it trusts
///
/// Nodes that trust each other's keys exchange messages over an authenticated, encrypted link; see
/// --secure-listen and --secure-peer. A running node notices a change of its files within a second.
/// A command that changes one waits for all running services that use it, and says whether they have
/// taken the change.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus keys new\n  \
    jaus keys new --key 'pkcs11:token=rover;object=node?module-path=/usr/lib/softhsm/libsofthsm2.so&pin-source=/etc/jaus/pin'\n  \
    jaus keys trust rover WkE5vXW4lFyQ3nDzGnUlnQ0Xs0mB5bqkVHk0pJ1Yd2s= 101.255.255\n  \
    jaus keys trust console 0b2yKQZ0C3r1mHqkqfM3d5bq0f5fY1b5o8hGxqj9n3E= 60.1.255 control=127\n  \
    jaus keys allow console control=200 clear-emergency\n  \
    jaus keys list\n  \
    jaus keys rotate\n  \
    jaus keys ca issue rover WkE5vXW4lFyQ3nDzGnUlnQ0Xs0mB5bqkVHk0pJ1Yd2s= 101.255.255 > rover.crt\n  \
    jaus keys revoke rover\n\n\
    Exit status: 0 done, and every running service that uses the file has taken the change; 1 the \
    file is changed, but a service has not taken the change within 2 s, or it cannot be confirmed; \
    also 1 if there was nothing to change or list; 2 the file is not changed.")]
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
    /// Replace the key without stopping the node: first make the next one, then use it
    Rotate(rotate::Rotate),
    /// Trust the key of a peer for these ids; it may observe, unless there are rules
    Trust(TrustKey),
    /// Replace the rules of a peer: what it may do besides observing
    Allow(Allow),
    /// No longer trust a peer; its links to running nodes end
    Revoke(Revoke),
    /// Approve a proposed change of the trusted keys, or list those that wait
    Approve(approve::Approve),
    /// List the trusted keys, the ids that they may speak for, and their rules
    List(List),
    /// Show which messages a peer may send, and why not the others
    Explain(explain::Explain),
    /// Issue and revoke certificates, instead of trusting each key on each host
    Ca(ca::Ca),
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

    /// Its public key, as `jaus keys show` prints it there; or the word `certificate` for the ids
    /// and rules of the certificate with this name
    #[arg(value_name = "KEY")]
    proof: Proof,

    /// The ids that it may speak for, separated by commas: 101.255.255 for all of subsystem 101
    ids: Ids,

    #[command(flatten)]
    rules: RuleWords,

    /// Add a further key to a name that has one already
    #[arg(long)]
    also: bool,

    #[command(flatten)]
    signer: approve::Signer,

    #[command(flatten)]
    files: KeyFiles,
}

/// What a peer shows.
#[derive(Clone)]
enum Proof {
    Key(PublicKey),
    Certificate,
}

impl FromStr for Proof {
    type Err = <PublicKey as FromStr>::Err;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "certificate" => Ok(Self::Certificate),
            key => key.parse().map(Self::Key),
        }
    }
}

#[derive(Args)]
struct Allow {
    /// The peer's name
    name: String,

    #[command(flatten)]
    rules: RuleWords,

    #[command(flatten)]
    signer: approve::Signer,

    #[command(flatten)]
    files: KeyFiles,
}

/// The rules of a peer.
#[derive(Args)]
struct RuleWords {
    /// What it may do besides observing: command, control=AUTHORITY, clear-emergency, configure; and
    /// its limits: with=IDS, only=NAMES, except=NAMES (services, messages or codes); also=CODES for messages that no
    /// definition has
    #[arg(value_name = "RULE")]
    rules: Vec<String>,

    #[command(flatten)]
    jsidl: Jsidl,
}

impl RuleWords {
    fn rules(&self) -> Result<Rules, Failure> {
        let rules: Rules = self.rules.join(" ").parse().map_err(Failure::of)?;
        let table = table_with(self.jsidl.paths())?;
        rules.verify(&table).map_err(Failure::of)?;
        Ok(rules)
    }
}

/// Ids, separated by commas.
#[derive(Clone)]
struct Ids(Vec<JausId>);

impl FromStr for Ids {
    type Err = <JausId as FromStr>::Err;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let ids = text.split(',').map(str::parse);
        ids.collect::<Result<_, _>>().map(Self)
    }
}

#[derive(Args)]
struct Revoke {
    /// The peer's name
    name: String,

    /// Only this key of the peer
    #[arg(value_name = "KEY")]
    public_key: Option<PublicKey>,

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
            Action::Allow(it) => it.replace(),
            Action::Revoke(it) => it.remove(),
            Action::Approve(it) => it.run(),
            Action::List(it) => it.list(),
            Action::Rotate(it) => it.run(),
            Action::Explain(it) => it.run(),
            Action::Ca(it) => it.run(),
        }
    }
}

impl Files {
    fn make(&self) -> Result<Outcome, Failure> {
        let path = self.files.key()?;
        if !Key::is_in_token(&path) {
            make_folder_of(&path)?;
        }
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
        let (name, ids) = (self.name.clone(), self.ids.0.clone());
        let rules = self.rules.rules()?;
        let (peer, grant);
        let (line, done): (String, Box<dyn Fn() -> _>) = match self.proof {
            Proof::Key(key) => {
                peer = Peer {
                    name,
                    key,
                    ids,
                    rules,
                };
                tell_sharing(&path, &peer);
                let add = || edit::trust(&path, &peer, self.also);
                (peer.to_string(), Box::new(add))
            }
            Proof::Certificate => {
                grant = Grant { name, ids, rules };
                (grant.to_string(), Box::new(|| edit::grant(&path, &grant)))
            }
        };
        match approve::control(&self.files)? {
            Some(control) => self.signer.propose(&control, approve::COMMAND, &[line]),
            None => with_uptake(&path, || done().map_err(Failure::of)),
        }
    }
}

/// Names the peers that may use ids of a new one. A file that cannot be read is no reason to be silent about the
/// change that follows, which names it.
fn tell_sharing(path: &Path, peer: &Peer) {
    let text = fs::read_to_string(path).unwrap_or_default();
    let trust = Trust::parse(&text).unwrap_or_default();
    for other in trust.sharing(peer) {
        let ids = |of: &Peer| of.ids.iter().map(JausId::to_string).collect::<Vec<_>>();
        say(format_args!(
            "`{}` ({}) shares ids with `{}` ({}): an id belongs to the key with the narrower ids, and to both \
             if they are as wide; give each key ids of its own, unless one is a relay",
            peer.name,
            ids(peer).join(","),
            other.name,
            ids(other).join(","),
        ));
    }
}

impl Allow {
    fn replace(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        let rules = self.rules.rules()?;
        if let Some(control) = approve::control(&self.files)? {
            let lines = edit::allowed(&path, &self.name, &rules).map_err(Failure::of)?;
            check_there(!lines.is_empty(), &self.name, &path)?;
            return self.signer.propose(&control, approve::COMMAND, &lines);
        }
        with_uptake(&path, || {
            let is_there = edit::allow(&path, &self.name, &rules).map_err(Failure::of)?;
            check_there(is_there, &self.name, &path)
        })
    }
}

impl Revoke {
    fn remove(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        with_uptake(&path, || {
            let was_there = edit::revoke(&path, &self.name, self.public_key);
            check_there(was_there.map_err(Failure::of)?, &self.name, &path)?;
            approve::forget_removed(&self.files);
            Ok(())
        })
    }
}

fn check_there(is_there: bool, name: &str, path: &Path) -> Result<(), Failure> {
    if is_there {
        return Ok(());
    }
    Err(Failure::negative(format!(
        "`{name}` is not in {}: see `jaus keys list`",
        path.display()
    )))
}

impl List {
    fn list(&self) -> Result<Outcome, Failure> {
        let path = self.files.trusted_keys()?;
        let text = fs::read_to_string(&path).map_err(|error| Failure::file(&path, &error))?;
        let trust = Trust::parse(&text).map_err(Failure::of)?;
        let mut output = Output::new();
        let peers = trust.peers().iter();
        let keys = peers.map(|it| (&it.name, it.key.to_string(), &it.ids, &it.rules));
        let grants = trust.grants().iter();
        let certificates =
            grants.map(|it| (&it.name, "certificate".to_owned(), &it.ids, &it.rules));
        let mut is_empty = true;
        for (name, key, ids, rules) in keys.chain(certificates) {
            is_empty = false;
            let ids: Vec<_> = ids.iter().map(JausId::to_string).collect();
            if self.json {
                let rules = rules.to_string();
                output.line(json!({ "name": name, "key": key, "ids": ids, "rules": rules }))?;
            } else {
                let ids = ids.join(",");
                let rules = match rules.to_string() {
                    none if none.is_empty() => "observe".to_owned(),
                    rules => rules,
                };
                output.line(format_args!("{name:16} {key:44}  {ids}  {rules}"))?;
            }
        }
        Ok(Outcome::complete_if(!is_empty))
    }
}
