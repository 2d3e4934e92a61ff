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

/// A party: the subject, or a peer.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Party {
    /// Its name in the table.
    pub(crate) name: String,
    /// Its id as the answering side.
    #[serde(deserialize_with = "id")]
    pub(crate) id: JausId,
    /// The component that reports the velocity, if different.
    #[serde(default, deserialize_with = "some_id")]
    pub(crate) sensor: Option<JausId>,
    /// Its id as the acting side.
    #[serde(deserialize_with = "id")]
    pub(crate) actor: JausId,
    /// Node settings that it requires of other parties, in the format of this project's settings
    /// file; `{needs}` in their commands.
    #[serde(default)]
    pub(crate) needs: String,
    /// A command that prints the version.
    #[serde(default)]
    pub(crate) version: Vec<String>,
    /// Whether its two directions cannot run at the same time, because it uses resources outside
    /// its namespace.
    #[serde(default)]
    pub(crate) alone: bool,
    /// Processes that always run, such as its node manager.
    #[serde(default)]
    pub(crate) background: Vec<Start>,
    /// Commands of the answering side.
    #[serde(default)]
    pub(crate) side: BTreeMap<Side, Start>,
    /// Commands of the acting side, by the key of the act.
    #[serde(default)]
    pub(crate) act: BTreeMap<String, Vec<String>>,
    /// Texts that its output must contain, by the key of the scenario, if not the ids and names of
    /// services.
    #[serde(default)]
    pub(crate) finds: BTreeMap<String, Vec<String>>,
    /// Scenarios that it does not answer, by key, with the reason.
    #[serde(default)]
    pub(crate) not_answering: BTreeMap<String, String>,
    /// Scenarios that it does not act in, with the reason.
    #[serde(default)]
    pub(crate) not_acting: BTreeMap<String, String>,
}

/// Role of an answering party.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Side {
    /// A component with services: discovery, events, control, velocity, wrench effort.
    Vehicle,
    /// A component that sends every test message back unchanged.
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
    /// What it prints once it is ready; without this, it counts as ready at once.
    pub(crate) ready: Option<String>,
    /// Services that it must list: the last parts of their URNs.
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

    /// Checks that every key belongs to an existing scenario or act.
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

    /// Why it does not answer a scenario, if it declares so.
    pub(crate) fn excuse_of_answerer(&self, scenario: Scenario) -> Option<&str> {
        excuse(&self.not_answering, scenario)
    }

    /// Why it does not act in a scenario, if it declares so.
    pub(crate) fn excuse_of_actor(&self, scenario: Scenario) -> Option<&str> {
        excuse(&self.not_acting, scenario)
    }
}

/// Replaces each `${NAME}` by the value of that environment variable.
pub(crate) fn with_environment(word: &str) -> Result<String, String> {
    let mut filled = String::new();
    let mut rest = word;
    while let Some((before, behind)) = rest.split_once("${") {
        let (name, behind) = behind
            .split_once('}')
            .ok_or_else(|| format!("`{word}`: there is no }} after ${{"))?;
        let value = std::env::var(name).map_err(|_| {
            format!("`{word}`: set the environment variable {name}; README.md describes it")
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
