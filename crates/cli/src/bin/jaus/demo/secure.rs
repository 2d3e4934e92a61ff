//! The secure links of a demo: a key for each node, and the vehicle's first node as a relay to which
//! the others connect.

use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use jaus::node::{Config, Node};
use jaus_cli::failure::Failure;
use jaus_secure::rules::Rules;
use jaus_secure::{Key, Peer, SecureLink, Settings, TrustFile, edit};

use super::system::{OPERATOR, VEHICLE};

/// The subsystem of commands in another terminal.
const VISITOR: u16 = 43;
/// The nodes: name, subsystem, node, and the rules of the relay for their keys. The relay is the
/// first.
const NODES: [(&str, u16, u8, &str); 5] = [
    ("communicator", VEHICLE, 1, ""),
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

/// Keys and trust files in a folder, which is removed at the end.
pub(super) struct SecureLinks {
    folder: PathBuf,
    relay: Option<SocketAddr>,
}

impl SecureLinks {
    /// Makes the keys, and trust files for them.
    pub(super) fn make() -> Result<Self, Failure> {
        let name = format!("jaus-demo-keys-{}", std::process::id());
        let links = Self {
            folder: std::env::temp_dir().join(name),
            relay: None,
        };
        fs::create_dir(&links.folder).map_err(|error| Failure::file(&links.folder, &error))?;
        links.make_keys()?;
        Ok(links)
    }

    fn make_keys(&self) -> Result<(), Failure> {
        let [(relay, ..), others @ ..] = NODES;
        let relay_key = self.make_key(relay)?;
        for (name, subsystem, node, rules) in others {
            let peer = Peer {
                name: name.to_owned(),
                key: self.make_key(name)?,
                ids: vec![jaus::address::JausId::new(subsystem, node, 255)],
                rules: rules.parse().map_err(Failure::of)?,
            };
            edit::trust(&self.trusted_keys(relay), &peer).map_err(Failure::of)?;
            let peer = Peer {
                name: relay.to_owned(),
                key: relay_key,
                ids: vec![jaus::address::JausId::EVERYONE],
                rules: Rules::everything(),
            };
            edit::trust(&self.trusted_keys(name), &peer).map_err(Failure::of)?;
        }
        Ok(())
    }

    fn make_key(&self, name: &str) -> Result<jaus_secure::PublicKey, Failure> {
        let key = Key::create(&self.key(name)).map_err(Failure::of)?;
        Ok(key.public())
    }

    fn key(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.key"))
    }

    fn trusted_keys(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.trusted_keys"))
    }

    /// Starts a node without plain JUDP. The relay comes first.
    pub(super) fn start(&mut self, subsystem: u16, number: u8) -> Result<Node, Failure> {
        let is_wanted = |it: &&(&str, u16, u8, &str)| (it.1, it.2) == (subsystem, number);
        let name = NODES.iter().find(is_wanted).map_or("visitor", |it| it.0);
        let key = Key::load(&self.key(name)).map_err(Failure::of)?;
        let trust = TrustFile::load(&self.trusted_keys(name)).map_err(Failure::of)?;
        let mut settings = Settings::new(SocketAddr::from(([127, 0, 0, 1], 0)));
        if let Some(relay) = self.relay {
            settings = settings.connect(relay);
        }
        let link = SecureLink::open(&key, trust, settings).map_err(Failure::of)?;
        let mut config = Config::new(subsystem, number).without_udp();
        if self.relay.is_none() {
            let address = link
                .local()
                .map_err(|error| Failure::file(Path::new("UDP"), &error))?;
            self.relay = Some(address);
            config.routing.forward = true;
        }
        Node::start_with(config, vec![Box::new(link)]).map_err(Failure::of)
    }

    /// The flags by which other commands join: they may observe.
    pub(super) fn flags(&self) -> String {
        let relay = self.relay.map(|it| it.to_string()).unwrap_or_default();
        let [key, trusted] = [self.key("visitor"), self.trusted_keys("visitor")];
        format!(
            "--id {VISITOR}.1.1 --secure-peer {relay} --key {} --trusted-keys {}",
            key.display(),
            trusted.display()
        )
    }
}

impl Drop for SecureLinks {
    fn drop(&mut self) {
        // The system's clean-up of temporary files removes what is left.
        let _ = fs::remove_dir_all(&self.folder);
    }
}
