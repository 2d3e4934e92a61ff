//! The bridge as a component: the zenoh session, the table of this side's components, and the views.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use jaus::link::custom::CustomLink;
use jaus::node::{Node, Recorder, now};
use jaus_vehicle::parts::{Part, PartError, Slot};
use tokio::sync::mpsc;
use tokio::time::MissedTickBehavior;

use crate::exchange::{Exchange, Settings};
use crate::key::BridgeId;
use crate::link::{NAME, Shared, ZenohLink};
use crate::network::{self, NetworkError, NetworkSettings};
use crate::proof;
use crate::view::{MOST_WAITING, Viewer};

/// How often the table of this side's components is renewed.
const RENEWAL: Duration = Duration::from_secs(1);

/// A bridge between the JAUS system of a node and a zenoh network.
///
/// The node has to forward between its links ([`Routing`](jaus::endpoint::Routing)).
///
/// ```no_run
/// # use jaus::component::Kind;
/// # use jaus::node::{Config, Node};
/// # use jaus_vehicle::parts::{Part, Slot};
/// # use jaus_zenoh::{Bridge, NetworkSettings, Settings};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let mut network = NetworkSettings::default();
/// network.connect.push("tcp/192.168.7.2:7447".to_owned());
/// let mut bridge = Bridge::new(Settings::default(), &network, None)?;
/// let mut config = Config::new(101, 250);
/// config.routing.forward = true;
/// let node = Node::start_with(config, bridge.links())?;
/// let slot = Slot::new(node.attach(1)?, node, Kind::Vehicle, "Rover");
/// bridge.run(slot).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Bridge {
    shared: Arc<Shared>,
    config: zenoh::Config,
}

impl Bridge {
    /// A bridge with these settings. It connects when it runs. The recorder takes what it decides on messages
    /// of other bridges, for an audit log.
    ///
    /// # Errors
    /// Settings that zenoh cannot use, or ids with rights on a network that proves nobody's identity.
    pub fn new(
        settings: Settings,
        network: &NetworkSettings,
        recorder: Option<Recorder<BridgeId>>,
    ) -> Result<Self, NetworkError> {
        let id = BridgeId::random();
        let mut network = network.clone();
        // So that its keys tell which session of the network it is.
        network.id.get_or_insert_with(|| id.to_string());
        let config = network.config()?;
        if !settings.accept.only_watches() {
            check_network(&config, settings.trusts_network)?;
        }
        let exchange = Exchange::new(id, settings);
        let shared = Arc::new(Shared::new(exchange, recorder));
        Ok(Self { shared, config })
    }

    /// Enters the components of this side: those of the node, and those that it hears on its other
    /// links.
    fn renew(&self, node: &Node) {
        let now = now();
        let own = node.components().into_iter().map(|it| (it.id, now));
        let mut outside = BTreeMap::new();
        let peers = node.peers().into_iter().filter(|peer| {
            let link = peer.path.link;
            let is_outside = outside
                .entry(link)
                .or_insert_with(|| node.link_name(link).is_none_or(|name| name == NAME));
            !*is_outside
        });
        let heard = own.chain(peers.map(|peer| (peer.id, peer.last_heard)));
        let heard: Vec<_> = heard.collect();
        self.shared.with(|exchange| {
            for (id, at) in heard {
                exchange.handle_local(now, id, at);
            }
            exchange.expire(now);
        });
    }
}

/// Checks that links prove who is at their other end, or warns if the network is trusted nevertheless.
fn check_network(config: &zenoh::Config, is_trusted: bool) -> Result<(), NetworkError> {
    match proof::check(config) {
        Ok(()) => Ok(()),
        Err(reason) if is_trusted => {
            tracing::warn!(
                "--trust-network: whoever reaches this zenoh network can act as the ids of --accept, \
                 because {reason}"
            );
            Ok(())
        }
        Err(reason) => Err(NetworkError::Unproven { reason }),
    }
}

/// The thread of the zenoh session. It ends when this is dropped.
struct SessionThread(Arc<Shared>);

impl SessionThread {
    fn start(
        bridge: &Bridge,
        requests: mpsc::Sender<crate::view::Request>,
    ) -> std::io::Result<Self> {
        let (shared, config) = (bridge.shared.clone(), bridge.config.clone());
        let thread = std::thread::Builder::new().name(NAME.to_owned());
        thread.spawn(move || network::run(&shared, &config, &requests))?;
        Ok(Self(bridge.shared.clone()))
    }
}

impl Drop for SessionThread {
    fn drop(&mut self) {
        self.0.close();
        let counters = self.0.lock().exchange.counters().clone();
        for (counter, number) in counters.iter().filter(|(_, number)| *number > 0) {
            tracing::info!("{number} {counter}");
        }
    }
}

impl Part for Bridge {
    fn links(&mut self) -> Vec<Box<dyn CustomLink>> {
        vec![Box::new(ZenohLink::new(self.shared.clone()))]
    }

    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let Some(node) = slot.node.clone() else {
            let words =
                "the bridge opens a link of its own, so it runs its own node: omit --attach";
            return Err(PartError::Broken(words.to_owned()));
        };
        let resident = slot.port.reside();
        let component = slot.component("zenoh bridge").live_on(slot.port)?;
        self.renew(&node);
        let (sender, mut requests) = mpsc::channel(MOST_WAITING);
        let _session = SessionThread::start(&self, sender)
            .map_err(|error| PartError::Broken(format!("no thread for zenoh: {error}")))?;
        let mut viewer = Viewer::new(component, self.shared.clone());
        let mut renewal = tokio::time::interval(RENEWAL);
        renewal.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = renewal.tick() => self.renew(&node),
                Some(request) = requests.recv() => viewer.handle(request),
                () = resident.closing() => return Err(PartError::NodeStopped),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use jaus::rights::Acceptance;

    use super::*;

    fn bridge(grant: &str, trusts_network: bool) -> Result<Bridge, NetworkError> {
        let settings = Settings {
            accept: Acceptance::new([grant.parse().unwrap()]),
            trusts_network,
            ..Settings::default()
        };
        let mut network = NetworkSettings::default();
        network.connect.push("tcp/127.0.0.1:7447".to_owned());
        Bridge::new(settings, &network, None)
    }

    #[test]
    fn ids_get_no_rights_on_a_network_without_certificates_unless_it_is_trusted() {
        let error = bridge("60 control=127", false).unwrap_err().to_string();
        assert!(error.contains("tcp/127.0.0.1:7447"), "{error}");
        assert!(error.contains("--trust-network"), "{error}");
        assert!(bridge("60 observe", false).is_err(), "it sets emergencies");
        assert!(bridge("60 control=127", true).is_ok());
        assert!(bridge("60 except=SetEmergency", false).is_ok());
    }

    #[test]
    fn the_id_of_a_bridge_is_that_of_its_zenoh_session() {
        let bridge = bridge("60 except=SetEmergency", false).unwrap();
        let id = bridge.config.get_json("id").unwrap();
        let key = bridge
            .shared
            .lock()
            .exchange
            .token_key("60.1.1".parse().unwrap());
        assert!(key.ends_with(id.trim_matches('"')), "{key} {id}");
    }
}
