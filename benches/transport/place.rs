//! Where a component of the benchmark runs: in its own node, or on another process's node.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use jaus::address::JausId;
use jaus::link::local::Address;
use jaus::node::{Config, Host, Node, Port};

use crate::run;

/// Where a component runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// In its own node.
    Own,
    /// On the node that serves this socket.
    On(PathBuf),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own => f.write_str("own"),
            Self::On(path) => path.display().fmt(f),
        }
    }
}

impl FromStr for Place {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "own" => Self::Own,
            path => Self::On(Path::new(path).into()),
        })
    }
}

/// An attached component, with its node if it runs its own.
pub(crate) struct Component {
    pub(crate) port: Port,
    _node: Option<Node>,
}

impl Place {
    /// Attaches a component there.
    pub(crate) async fn attach(&self, id: JausId) -> Component {
        match self {
            Self::Own => {
                let node = Node::start(settings(id)).expect("a node on loopback");
                let port = node.attach(id.component()).expect("a free number");
                Component {
                    port,
                    _node: Some(node),
                }
            }
            Self::On(path) => {
                let host = Host::at(Address::Path(path.clone()));
                let port = host.attach(id.component()).await.expect("a place there");
                Component { port, _node: None }
            }
        }
    }
}

/// Settings of a node on loopback, in a group that no other program of this host uses, nor another
/// run.
pub(crate) fn settings(id: JausId) -> Config {
    let mut config = Config::loopback(id.subsystem(), id.node());
    let port = 20_000 + run::number() % 40_000;
    config.group = format!("239.255.77.7:{port}").parse().expect("a group");
    config
}

/// Starts a node that serves other processes.
pub(crate) fn serve(id: JausId, place: &Place) -> Node {
    let Place::On(path) = place else {
        panic!("a node for others needs a socket");
    };
    Node::start(settings(id).local(Address::Path(path.clone()))).expect("a node for others")
}
