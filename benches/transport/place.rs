//! Where a component of the benchmark lives: in a node of its own, or on the node of another
//! process.

use std::env;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use jaus::address::JausId;
use jaus::link::local::Address;
use jaus::node::{Config, Host, Node, Port};

use crate::child::Process;
use crate::roles::Role;

/// Names the run to its child processes.
pub(crate) const RUN: &str = "JAUS_BENCH_RUN";

/// The number of this run: the id of the process that the user has started.
pub(crate) fn run() -> u32 {
    let told = env::var(RUN).ok().and_then(|number| number.parse().ok());
    told.unwrap_or_else(std::process::id)
}

/// A folder of this run for sockets, shared by all its processes.
pub(crate) fn folder() -> PathBuf {
    let folder = env::temp_dir().join(format!("jaus-bench-{}", run()));
    fs::create_dir_all(&folder).expect("a folder for sockets");
    folder
}

/// Where a component lives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// In a node of its own.
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

/// An attached component, with the node if it has one of its own.
pub(crate) struct Component {
    pub(crate) port: Port,
    _node: Option<Node>,
}

impl Place {
    /// Brings a component to life there.
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

/// A node on loopback, in a group that no other program of this host is in, nor another run.
pub(crate) fn settings(id: JausId) -> Config {
    let mut config = Config::loopback(id.subsystem(), id.node());
    let port = 20_000 + run() % 40_000;
    config.group = format!("239.255.77.7:{port}").parse().expect("a group");
    config
}

/// How two components of the benchmark stand to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Setting {
    /// Each carries a node of its own.
    OwnNodes,
    /// Both are attached to one node in a third process.
    OneNode,
    /// Each is attached to a node; the two nodes are two more processes.
    TwoNodes,
}

impl Setting {
    pub(crate) const ALL: [Self; 3] = [Self::OwnNodes, Self::OneNode, Self::TwoNodes];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::OwnNodes => "two components with a node of their own",
            Self::OneNode => "two component processes on one node",
            Self::TwoNodes => "two component processes on two nodes",
        }
    }

    /// The ids of the two components; others for each setting, because all are in one group.
    pub(crate) const fn ids(self) -> [JausId; 2] {
        match self {
            Self::OwnNodes => [JausId::new(101, 1, 33), JausId::new(102, 1, 33)],
            Self::OneNode => [JausId::new(103, 1, 33), JausId::new(103, 1, 34)],
            Self::TwoNodes => [JausId::new(104, 1, 33), JausId::new(105, 1, 33)],
        }
    }

    /// Starts the nodes, and says where the two components are to live.
    pub(crate) fn start(self) -> (Vec<Process>, [Place; 2]) {
        let node = |id: JausId, name: &str| {
            let place = Place::On(folder().join(format!("{self:?}-{name}.sock")));
            (Process::start(&Role::Node(id, place.clone())), place)
        };
        let [ours, theirs] = self.ids();
        match self {
            Self::OwnNodes => (Vec::new(), [Place::Own, Place::Own]),
            Self::OneNode => {
                let (process, place) = node(ours, "one");
                (vec![process], [place.clone(), place])
            }
            Self::TwoNodes => {
                let ((one, here), (two, there)) = (node(ours, "ours"), node(theirs, "theirs"));
                (vec![one, two], [here, there])
            }
        }
    }
}

/// Starts a node that serves other processes.
pub(crate) fn serve(id: JausId, place: &Place) -> Node {
    let Place::On(path) = place else {
        panic!("a node for others needs a socket");
    };
    Node::start(settings(id).local(Address::Path(path.clone()))).expect("a node for others")
}
