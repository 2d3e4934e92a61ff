//! Identity of a node, from flags and settings files.

use std::str::FromStr;

use clap::ValueEnum;
use serde::Deserialize;

use super::log_level::LogLevel;
use super::metrics::MetricsAddress;
use jaus::address::JausId;
use jaus::component::Kind;

/// Identity of a node, as far as it is configured.
#[derive(Debug, Default, Deserialize)]
pub struct Identity {
    /// The id of our component.
    pub(super) id: Option<OwnId>,
    /// The name of our subsystem.
    pub name: Option<String>,
    /// The kind of our subsystem.
    pub kind: Option<SubsystemKind>,
    /// Where metrics for Prometheus are served: an address with its port, or a port of 127.0.0.1.
    pub metrics: Option<MetricsAddress>,
    /// The log level: error, warn, info, debug or trace, or levels by module such as
    /// `warn,jaus::endpoint=trace`. SIGUSR1 reads it again.
    pub log_level: Option<LogLevel>,
}

/// A single component without wildcards: `101.1.33`, or `101.1`, which means component 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct OwnId(pub(super) JausId);

impl FromStr for OwnId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = match text.matches('.').count() {
            1 => format!("{text}.1"),
            _ => text.to_owned(),
        };
        let id: JausId = whole.parse().map_err(|error| format!("{error}"))?;
        if id.is_unicast() {
            return Ok(Self(id));
        }
        Err(format!(
            "{id} is not a single component: choose a subsystem from 1 to 65534, a node and a \
             component from 1 to 254"
        ))
    }
}

impl TryFrom<String> for OwnId {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// Kinds of subsystems, as written in flags and files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SubsystemKind {
    /// A vehicle or another acting system
    Vehicle,
    /// An operator control unit
    Ocu,
    /// Anything else
    Other,
}

impl From<SubsystemKind> for Kind {
    fn from(kind: SubsystemKind) -> Self {
        match kind {
            SubsystemKind::Vehicle => Self::Vehicle,
            SubsystemKind::Ocu => Self::OperatorControlUnit,
            SubsystemKind::Other => Self::OtherSubsystem,
        }
    }
}
