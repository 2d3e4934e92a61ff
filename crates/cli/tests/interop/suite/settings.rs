//! Settings of a party: a TOML file with its name, the commands that start it as the answering and
//! as the acting side, and its limitations. `README.md` beside this file explains every key.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use jaus::address::JausId;
use serde::Deserialize;

use crate::suite::scenario::Scenario;

/// A name without a file here is treated as a path.
pub(crate) const PEERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/interop/peers");

/// One who takes part: the subject, or a peer.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Party {
    /// What it is called in the table.
    pub(crate) name: String,
    /// Whom others speak to.
    #[serde(deserialize_with = "id")]
    pub(crate) id: JausId,
    /// The component that reports the velocity, if it is a different one.
    #[serde(default, deserialize_with = "some_id")]
    pub(crate) sensor: Option<JausId>,
    /// Who speaks to others.
    #[serde(deserialize_with = "id")]
    pub(crate) actor: JausId,
    /// What it needs of others, as a settings file of this project's says it; `{needs}` in their
    /// commands.
    #[serde(default)]
    pub(crate) needs: String,
    /// A command that prints the version.
    #[serde(default)]
    pub(crate) version: Vec<String>,
    /// Whether its two directions cannot run at once, because it keeps things outside its
    /// namespace.
    #[serde(default)]
    pub(crate) alone: bool,
    /// What runs whatever it does, such as its node manager.
    #[serde(default)]
    pub(crate) background: Vec<Start>,
    /// What answers.
    #[serde(default)]
    pub(crate) side: BTreeMap<Side, Start>,
    /// What acts, by the key of what it does.
    #[serde(default)]
    pub(crate) act: BTreeMap<String, Vec<String>>,
    /// Its words for what it must find, by the key of the scenario, where these are not ids and
    /// the names of services.
    #[serde(default)]
    pub(crate) finds: BTreeMap<String, Vec<String>>,
    /// What it does not answer, by the key of the scenario, and why.
    #[serde(default)]
    pub(crate) not_answering: BTreeMap<String, String>,
    /// What it does not do by itself, and why.
    #[serde(default)]
    pub(crate) not_acting: BTreeMap<String, String>,
}

/// What a party answers as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Side {
    /// A component with services: discovery, events, control, velocity, wrench effort.
    Vehicle,
    /// A component that sends every test message back as it came.
    Echo,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Vehicle => "a vehicle",
            Self::Echo => "an echo",
        })
    }
}

/// A process that runs until it is killed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Start {
    /// The program and its arguments.
    pub(crate) command: Vec<String>,
    /// What it prints once it can be spoken to; without it, it is spoken to at once.
    pub(crate) ready: Option<String>,
    /// The services that its list must have: the last parts of their URNs.
    #[serde(default)]
    pub(crate) services: Vec<String>,
}

fn some_id<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<JausId>, D::Error> {
    id(deserializer).map(Some)
}

fn id<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<JausId, D::Error> {
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(serde::de::Error::custom)
}

impl Party {
    /// Reads a party's file: one of ours by its name, or any by its path.
    pub(crate) fn load(name: &str) -> Result<Self, String> {
        let ours = Path::new(PEERS).join(format!("{name}.toml"));
        let path = if ours.exists() {
            ours
        } else {
            PathBuf::from(name)
        };
        let text = std::fs::read_to_string(&path).map_err(|error| {
            format!(
                "there is no peer `{name}`: {}: {error}; name a file of {PEERS} without .toml, or \
                 give a path",
                path.display()
            )
        })?;
        let wrong = |error: String| format!("{}: {error}", path.display());
        let mut party: Self = toml::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        party.name = with_environment(&party.name).map_err(wrong)?;
        party.check().map_err(wrong)?;
        Ok(party)
    }

    /// Whether everything is about a scenario that exists.
    fn check(&self) -> Result<(), String> {
        let keys: Vec<String> = Scenario::all()
            .iter()
            .map(|scenario| scenario.key())
            .collect();
        let excuses = self.not_answering.keys().chain(self.not_acting.keys());
        for key in excuses.chain(self.finds.keys()) {
            // A prefix stands for all keys that start with it.
            if !keys.iter().any(|known| known.starts_with(key.as_str())) {
                return Err(format!(
                    "no scenario `{key}`; there are: {}",
                    keys.join(", ")
                ));
            }
        }
        let acts = Scenario::acts();
        for key in self.act.keys() {
            if !acts.contains(&key.as_str()) {
                return Err(format!("no act `{key}`; there are: {}", acts.join(", ")));
            }
        }
        Ok(())
    }

    /// Why it does not answer a scenario, if it says so.
    pub(crate) fn excuse_of_answerer(&self, scenario: Scenario) -> Option<&str> {
        excuse(&self.not_answering, scenario)
    }

    /// Why it does not do what a scenario asks for, if it says so.
    pub(crate) fn excuse_of_actor(&self, scenario: Scenario) -> Option<&str> {
        excuse(&self.not_acting, scenario)
    }
}

/// Puts the values of variables in the place of `${NAME}`.
pub(crate) fn with_environment(word: &str) -> Result<String, String> {
    let mut filled = String::new();
    let mut rest = word;
    while let Some((before, behind)) = rest.split_once("${") {
        let (name, behind) = behind
            .split_once('}')
            .ok_or_else(|| format!("`{word}`: there is no }} behind ${{"))?;
        let value = std::env::var(name).map_err(|_| {
            format!("`{word}`: set the environment variable {name}; README.md tells what to")
        })?;
        filled = filled + before + &value;
        rest = behind;
    }
    Ok(filled + rest)
}

fn excuse(excuses: &BTreeMap<String, String>, scenario: Scenario) -> Option<&str> {
    let key = scenario.key();
    let of_this = excuses
        .iter()
        .find(|(about, _)| key.starts_with(about.as_str()));
    of_this.map(|(_, why)| why.as_str())
}
