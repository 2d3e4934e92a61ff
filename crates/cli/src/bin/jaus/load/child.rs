//! Child process of the load test: a node, or components that send and measure.
#![expect(clippy::disallowed_methods, reason = "a program owns its tasks")]

use std::net::SocketAddr;
use std::sync::Arc;

use clap::Args;
use jaus::address::JausId;
use jaus::link::Group;
use jaus::node::{Address, Config, Host, Node};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::Output;
use jaus_cli::runtime;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::components::Components;
use super::process::{Answer, NodeOrder, Order};

/// Subsystem of the load test.
const SUBSYSTEM: u16 = 101;

/// Serves the `jaus load` that started it.
#[derive(Args)]
pub(crate) struct LoadChild {}

impl LoadChild {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let (sender, orders) = unbounded_channel();
        std::thread::spawn(move || {
            let lines = std::io::stdin().lines().map_while(Result::ok);
            lines.for_each(|line| drop(sender.send(line)));
        });
        // As a task, like components: blocking on a future costs one more system call per turn.
        runtime::run(async {
            let task = tokio::spawn(obey(orders));
            task.await.map_err(Failure::of)?
        })
    }
}

/// The node or components of this process.
#[derive(Default)]
struct Running {
    node: Option<Node>,
    components: Option<Arc<Components>>,
}

async fn obey(mut orders: UnboundedReceiver<String>) -> Result<Outcome, Failure> {
    let mut running = Running::default();
    while let Some(line) = orders.recv().await {
        let order = serde_json::from_str(&line).map_err(Failure::of)?;
        let answer = match running.carry_out(order).await {
            Ok(answer) => answer,
            Err(failure) => Answer::Failed(failure.to_string()),
        };
        let answer = serde_json::to_string(&answer).map_err(Failure::of)?;
        Output::new().line(answer)?;
    }
    if let Some(components) = running.components {
        components.detach().await;
    }
    if let Some(node) = running.node {
        let socket = match &node.config().local {
            jaus::link::local::Local::At(Address::Path(path)) => Some(path.clone()),
            _ => None,
        };
        node.shutdown().await;
        // The last node to end removes the directory, even if the parent was killed.
        if let Some(directory) = socket.as_deref().and_then(std::path::Path::parent) {
            let _ = std::fs::remove_dir(directory);
        }
    }
    Ok(Outcome::Done)
}

impl Running {
    async fn carry_out(&mut self, order: Order) -> Result<Answer, Failure> {
        match order {
            Order::Serve(order) => {
                self.node = Some(Node::start(settings(order)?).map_err(Failure::of)?);
                Ok(Answer::Ready)
            }
            Order::Attach(places) => {
                let mut ports = Vec::with_capacity(places.len());
                for (address, number) in places {
                    let address = address.parse::<Address>().map_err(Failure::of)?;
                    let host = Host::at(address).name("jaus load");
                    ports.push(host.attach(number).await.map_err(Failure::of)?);
                }
                let ids = ports.iter().map(jaus::node::Port::id).collect();
                self.components = Some(Components::new(ports));
                Ok(Answer::Attached(ids))
            }
            Order::Partners(partners) => {
                self.components()?.pair(partners);
                Ok(Answer::Ready)
            }
            Order::Measure(run) => Ok(Answer::Measured(self.components()?.measure(run).await)),
        }
    }

    fn components(&self) -> Result<&Arc<Components>, Failure> {
        let missing = || Failure::new("no component is attached");
        self.components.as_ref().ok_or_else(missing)
    }
}

fn settings(order: NodeOrder) -> Result<Config, Failure> {
    let own = order.addresses.get(usize::from(order.node) - 1);
    let port = own.map_or(0, SocketAddr::port);
    let mut config = Config::loopback(SUBSYSTEM, order.node)
        .local(Address::Path(order.socket))
        .port(port)
        .group(Group::Off);
    for (node, address) in (1..).zip(&order.addresses) {
        if node != order.node {
            let components = JausId::new(SUBSYSTEM, node, JausId::ANY_COMPONENT);
            let peer = format!("{components}@{address}").parse();
            config = config.peer(peer.map_err(Failure::of)?);
        }
    }
    let peers = 2 * usize::from(order.components);
    config.limits.max_peers = config.limits.max_peers.max(peers);
    Ok(config)
}
