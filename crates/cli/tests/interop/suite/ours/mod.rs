//! Actions of this project's side for which the tool `jaus` has no command: roles in which this
//! binary is restarted, over the library's public API. `ours.toml` lists them.

mod asking;
mod driving;
mod large;

use std::process::ExitCode;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};

use crate::suite::scripted;

/// Says what went wrong, in a line.
pub(crate) type Outcome = Result<(), String>;

/// Arguments of a role on the command line: `KEY=VALUE` each.
#[derive(Debug, Clone)]
pub(crate) struct RoleArguments {
    /// Who we are.
    pub(crate) id: JausId,
    /// Whom to speak to.
    pub(crate) other: JausId,
    /// The component that reports the velocity, if it is a different one.
    sensor: Option<JausId>,
    /// An address: of the other for ours, of its own for a scripted peer.
    pub(crate) address: String,
    /// The octets of a message.
    pub(crate) size: usize,
    /// How long it may take.
    pub(crate) within: Duration,
    /// How messages go: `udp`, `unacknowledged` or `tcp`.
    pub(crate) by: String,
    /// What the other needs of a node: settings as in a file.
    needs: String,
}

/// Plays the role that the arguments name: one of ours, or `PEER PART` of a scripted peer.
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
            // These go on until they are killed.
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

    /// Another component on the same node.
    pub(crate) fn colleague(&self) -> JausId {
        let (subsystem, node) = (self.id.subsystem(), self.id.node());
        JausId::new(subsystem, node, self.id.component() + 1)
    }

    /// Who tells the velocity.
    fn sensor(&self) -> JausId {
        self.sensor.unwrap_or(self.other)
    }

    /// A node as it is by default, but for what the other needs.
    fn config(&self) -> Result<Config, String> {
        let needed = toml::from_str(&self.needs);
        let mut config: Config = needed.map_err(|error| format!("{}: {error}", self.needs))?;
        (config.subsystem, config.node) = (self.id.subsystem(), self.id.node());
        Ok(config.or_any_free_port())
    }

    /// A node with a component without own services.
    fn component(&self) -> Result<(Node, Component), String> {
        let node = Node::start(self.config()?).map_err(|error| error.to_string())?;
        let component = operator(&node, self.id)?;
        Ok((node, component))
    }
}

/// A component without own services.
fn operator(node: &Node, id: JausId) -> Result<Component, String> {
    Component::builder(Kind::OperatorControlUnit, "Interoperability")
        .attach(node, id.component())
        .map_err(|error| error.to_string())
}
