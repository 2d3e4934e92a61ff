//! Actions of this project's side for which the tool `jaus` has no command: roles in which this
//! binary is restarted, using the library's public API. `ours.toml` lists them.

mod asking;
mod driving;
mod large;

use std::process::ExitCode;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};

use crate::suite::scripted;

/// Result of a role, with the failure in one line.
pub(crate) type Outcome = Result<(), String>;

/// Arguments of a role on the command line, each `KEY=VALUE`.
#[derive(Debug, Clone)]
pub(crate) struct RoleArguments {
    /// Own id.
    pub(crate) id: JausId,
    /// Id of the other party.
    pub(crate) other: JausId,
    /// The component that reports the velocity, if different.
    sensor: Option<JausId>,
    /// An address: the other party's for our roles, its own for a scripted peer.
    pub(crate) address: String,
    /// Size of a message, in octets.
    pub(crate) size: usize,
    /// Timeout.
    pub(crate) within: Duration,
    /// Transport: `udp`, `unacknowledged` or `tcp`.
    pub(crate) by: String,
    /// Node settings that the other party requires, as TOML.
    needs: String,
}

/// Plays the role named by the arguments: one of ours, or `PEER PART` of a scripted peer.
pub(crate) fn play(arguments: &[String]) -> ExitCode {
    let outcome = match arguments {
        [scripted, peer, part, rest @ ..] if scripted == "scripted" => {
            RoleArguments::read(rest).and_then(|arguments| scripted::play(peer, part, &arguments))
        }
        _ => play_ours(arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn play_ours(arguments: &[String]) -> Outcome {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let runtime = runtime.map_err(|error| error.to_string())?;
    runtime.block_on(play_within(arguments))
}

async fn play_within(arguments: &[String]) -> Outcome {
    let (role, rest) = arguments.split_first().ok_or("which role?")?;
    let arguments = RoleArguments::read(rest)?;
    let limit = arguments.within;
    let work = async {
        match role.as_str() {
            "subscribe-periodic" => asking::periodic(&arguments).await,
            "subscribe-on-change" => driving::on_change(&arguments).await,
            "control" => driving::control(&arguments).await,
            "drive" => driving::drive(&arguments).await,
            "large" => large::send(&arguments).await,
            // These run until they are killed.
            "keep" => return Some(asking::keep(&arguments).await),
            "keep-echo" => return Some(large::keep(&arguments).await),
            "echo" => return Some(large::echo(&arguments).await),
            other => Err(format!("no role {other}")),
        }
        .into()
    };
    let is_endless = matches!(role.as_str(), "keep" | "keep-echo" | "echo");
    let outcome: Option<Outcome> = if is_endless {
        work.await
    } else {
        tokio::time::timeout(limit, work).await.unwrap_or(None)
    };
    outcome.unwrap_or_else(|| Err(format!("not done within {} s", limit.as_secs())))
}

impl RoleArguments {
    fn read(arguments: &[String]) -> Result<Self, String> {
        let mut read = Self {
            id: JausId::new(42, 1, 1),
            other: JausId::new(101, 1, 1),
            sensor: None,
            address: String::new(),
            size: 16,
            within: Duration::from_secs(30),
            by: "udp".to_owned(),
            needs: String::new(),
        };
        for argument in arguments {
            let wrong = || format!("`{argument}` cannot be");
            let (key, value) = argument.split_once('=').ok_or_else(wrong)?;
            match key {
                "id" => read.id = value.parse().map_err(|_| wrong())?,
                "other" => read.other = value.parse().map_err(|_| wrong())?,
                "sensor" => read.sensor = Some(value.parse().map_err(|_| wrong())?),
                "address" => value.clone_into(&mut read.address),
                "size" => read.size = value.parse().map_err(|_| wrong())?,
                "seconds" => {
                    read.within = Duration::from_secs(value.parse().map_err(|_| wrong())?);
                }
                "by" => value.clone_into(&mut read.by),
                "needs" => value.clone_into(&mut read.needs),
                _ => return Err(wrong()),
            }
        }
        Ok(read)
    }

    /// Id of another component on the same node.
    pub(crate) fn colleague(&self) -> JausId {
        let (subsystem, node) = (self.id.subsystem(), self.id.node());
        JausId::new(subsystem, node, self.id.component() + 1)
    }

    /// The component that reports the velocity.
    fn sensor(&self) -> JausId {
        self.sensor.unwrap_or(self.other)
    }

    /// The default node settings, with those that the other party requires.
    fn config(&self) -> Result<Config, String> {
        let needed = toml::from_str(&self.needs);
        let mut config: Config = needed.map_err(|error| format!("{}: {error}", self.needs))?;
        (config.subsystem, config.node) = (self.id.subsystem(), self.id.node());
        Ok(config.or_any_free_port())
    }

    /// A node with a component without services of its own.
    fn component(&self) -> Result<(Node, Component), String> {
        let node = Node::start(self.config()?).map_err(|error| error.to_string())?;
        let component = operator(&node, self.id)?;
        Ok((node, component))
    }
}

/// A component without services of its own.
fn operator(node: &Node, id: JausId) -> Result<Component, String> {
    Component::builder(Kind::OperatorControlUnit, "Interoperability")
        .attach(node, id.component())
        .map_err(|error| error.to_string())
}
