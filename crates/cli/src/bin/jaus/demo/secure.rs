//! The secure links of a demo: a key for each node, and a relay to which all connect.

use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;

use jaus::address::JausId;
use jaus::node::{Config, Node};
use jaus::rights::Rules;
use jaus_cli::failure::Failure;
use jaus_secure::{Key, Peer, PublicKey, SecureLink, Settings, TrustFile, edit};

use super::network::{OPERATOR, VEHICLE};

/// The subsystem of commands in another terminal.
const VISITOR: u16 = 43;
/// The subsystem of the relay.
const RELAY: u16 = 200;
/// The name of the relay's key.
const RELAY_KEY: &str = "relay";
/// The nodes: name, subsystem, node, and the rules of the relay for their keys.
const NODES: [(&str, u16, u8, &str); 5] = [
    (
        "communicator",
        VEHICLE,
        1,
        "control=255 clear-emergency configure",
    ),
    (
        "wheels",
        VEHICLE,
        2,
        "control=255 clear-emergency configure",
    ),
    ("mind", VEHICLE, 3, "control=255 clear-emergency configure"),
    ("console", OPERATOR, 1, "control=200 clear-emergency"),
    ("visitor", VISITOR, 1, "observe"),
];

/// The relay, and the keys of the nodes.
pub(super) struct SecureLinks {
    keys: Keys,
    relay: Node,
    address: SocketAddr,
    /// The address that the operator's node connects to: the relay's, or a NAT's before it.
    entry_of_operator: SocketAddr,
}

impl SecureLinks {
    /// Makes the keys, and trust files for them, and starts the relay.
    pub(super) fn make() -> Result<Self, Failure> {
        let name = format!("jaus-demo-keys-{}", std::process::id());
        let keys = Keys(std::env::temp_dir().join(name));
        fs::create_dir(&keys.0).map_err(|error| Failure::file(&keys.0, &error))?;
        keys.make()?;
        let (relay, address) = start_relay(&keys, SocketAddr::from(([127, 0, 0, 1], 0)))?;
        Ok(Self {
            keys,
            relay,
            address,
            entry_of_operator: address,
        })
    }

    /// Starts a node without plain JUDP, and connects it to the relay.
    pub(super) fn start(&self, subsystem: u16, number: u8) -> Result<Node, Failure> {
        let is_wanted = |it: &&(&str, u16, u8, &str)| (it.1, it.2) == (subsystem, number);
        let name = NODES.iter().find(is_wanted).map_or("visitor", |it| it.0);
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let entry = match subsystem {
            OPERATOR => self.entry_of_operator,
            _ => self.address,
        };
        let link = self.keys.open(name, Settings::new(any).connect(entry))?;
        let config = Config::new(subsystem, number).without_udp();
        Node::start_with(config, vec![Box::new(link)]).map_err(Failure::of)
    }

    /// The flags by which other commands join: they may observe.
    pub(super) fn flags(&self) -> String {
        let [key, trusted] = [self.keys.key("visitor"), self.keys.trusted_keys("visitor")];
        format!(
            "--id {VISITOR}.1.1 --secure-peer {} --key {} --trusted-keys {}",
            self.address,
            key.display(),
            trusted.display()
        )
    }

    /// Stops the relay.
    pub(super) async fn stop(self) {
        self.relay.shutdown().await;
    }
}

/// Starts the relay at an address; returns the address with its port.
fn start_relay(keys: &Keys, address: SocketAddr) -> Result<(Node, SocketAddr), Failure> {
    let link = keys.open(RELAY_KEY, Settings::new(address))?;
    let address = link.local().map_err(Failure::of)?;
    let mut config = Config::new(RELAY, 1).without_udp();
    config.routing.forward = true;
    let relay = Node::start_with(config, vec![Box::new(link)]).map_err(Failure::of)?;
    Ok((relay, address))
}

/// Keys and trust files in a folder, which is removed at the end.
struct Keys(PathBuf);

impl Keys {
    fn make(&self) -> Result<(), Failure> {
        let relay = self.make_key(RELAY_KEY)?;
        for (name, subsystem, node, rules) in NODES {
            let peer = Peer {
                name: name.to_owned(),
                key: self.make_key(name)?,
                ids: vec![JausId::new(subsystem, node, 255)],
                rules: rules.parse().map_err(Failure::of)?,
            };
            edit::trust(&self.trusted_keys(RELAY_KEY), &peer, false).map_err(Failure::of)?;
            let peer = Peer {
                name: RELAY_KEY.to_owned(),
                key: relay,
                ids: vec![JausId::EVERYONE],
                rules: Rules::everything(),
            };
            edit::trust(&self.trusted_keys(name), &peer, false).map_err(Failure::of)?;
        }
        Ok(())
    }

    fn open(&self, name: &str, settings: Settings) -> Result<SecureLink, Failure> {
        let key = Key::load(&self.key(name)).map_err(Failure::of)?;
        let trust = TrustFile::load(&self.trusted_keys(name)).map_err(Failure::of)?;
        SecureLink::open(&key, trust, settings).map_err(Failure::of)
    }

    fn make_key(&self, name: &str) -> Result<PublicKey, Failure> {
        let key = Key::create(&self.key(name)).map_err(Failure::of)?;
        Ok(key.public())
    }

    fn key(&self, name: &str) -> PathBuf {
        self.0.join(format!("{name}.key"))
    }

    fn trusted_keys(&self, name: &str) -> PathBuf {
        self.0.join(format!("{name}.trusted_keys"))
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        // The system's clean-up of temporary files removes what is left.
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests;
