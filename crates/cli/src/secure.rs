//! Flags and settings of the secure link: this node's key, the keys that it trusts, and the peers.

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use jaus::link::Interfaces;
use jaus::node::Config;
use jaus_secure::{Key, SecureLink, TrustFile};
use serde::Deserialize;

use super::failure::Failure;
use super::folders::config_folder;
use super::settings;

/// The UDP port of secure links.
pub const PORT: u16 = 3795;

/// An address with a port, [`PORT`] by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Address(SocketAddr);

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = text.parse().ok();
        let ip = || text.parse::<IpAddr>().ok().map(|ip| (ip, PORT).into());
        whole.or_else(ip).map(Self).ok_or_else(|| {
            format!("`{text}` is not an address: write 192.168.7.2 or 192.168.7.2:{PORT}")
        })
    }
}

impl TryFrom<String> for Address {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

#[derive(Args, Debug)]
#[command(next_help_heading = "Secure link")]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct SecureFlags {
    /// Accept authenticated, encrypted links at this address, and no plain JUDP unless an interface
    /// for it is named [default: 0.0.0.0:3795]
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0.0.0.0",
    )]
    secure_listen: Option<Address>,

    /// Connect to this peer by an authenticated, encrypted link, and use no plain JUDP unless an
    /// interface for it is named (repeatable)
    #[arg(long, value_name = "ADDRESS")]
    secure_peer: Vec<Address>,

    #[command(flatten)]
    files: KeyFiles,
}

/// The files of keys.
#[derive(Args, Debug)]
pub struct KeyFiles {
    /// The file of this node's key [default: ~/.config/jaus/node.key]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,

    /// The file of the keys that this node trusts [default: trusted_keys beside the key]
    #[arg(long, value_name = "FILE")]
    trusted_keys: Option<PathBuf>,
}

impl KeyFiles {
    /// The file of this node's key.
    ///
    /// # Errors
    /// Without a flag and a home directory.
    pub fn key(&self) -> Result<PathBuf, Failure> {
        if let Some(path) = &self.key {
            return Ok(path.clone());
        }
        let folder = config_folder().ok_or_else(|| {
            Failure::new("there is no home directory: name the file of the key with --key")
        })?;
        Ok(folder.join("node.key"))
    }

    /// The file of trusted keys.
    ///
    /// # Errors
    /// As [`key`](Self::key).
    pub fn trusted_keys(&self) -> Result<PathBuf, Failure> {
        match &self.trusted_keys {
            Some(path) => Ok(path.clone()),
            None => Ok(self.key()?.with_file_name("trusted_keys")),
        }
    }
}

/// The table `[secure]` of a settings file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Table {
    /// Accept secure links at this address, by default on port 3795. Flag: `--secure-listen`.
    listen: Option<Address>,
    /// Connect to these peers. Flag: `--secure-peer`.
    peers: Vec<Address>,
    /// The file of this node's key. Flag: `--key`.
    key: Option<PathBuf>,
    /// The file of the keys that this node trusts. Flag: `--trusted-keys`.
    trusted_keys: Option<PathBuf>,
}

/// The settings of a secure link.
#[derive(Debug)]
pub struct Secure {
    listen: Option<Address>,
    peers: Vec<Address>,
    files: KeyFiles,
}

impl SecureFlags {
    /// The settings from flags and the settings file; `None` if neither asks for a secure link.
    ///
    /// # Errors
    /// An unreadable file, or an invalid table.
    pub fn settings(&self, file: Option<&Path>) -> Result<Option<Secure>, Failure> {
        let table: Table = file.map(settings::secure).transpose()?.unwrap_or_default();
        let secure = Secure {
            listen: self.secure_listen.or(table.listen),
            peers: [&table.peers[..], &self.secure_peer].concat(),
            files: KeyFiles {
                key: self.files.key.clone().or(table.key),
                trusted_keys: self.files.trusted_keys.clone().or(table.trusted_keys),
            },
        };
        let is_wanted = secure.listen.is_some() || !secure.peers.is_empty();
        Ok(is_wanted.then_some(secure))
    }
}

impl Secure {
    /// Opens the link, and takes plain JUDP from the node's settings unless they name interfaces
    /// for it.
    ///
    /// # Errors
    /// A key or trust file that cannot be used, plain TCP connections beside the link, or an address
    /// that cannot be listened on.
    pub fn open(self, mut config: Config) -> Result<(Config, SecureLink), Failure> {
        if config.tcp != jaus::node::Tcp::default() {
            return Err(Failure::new(
                "plain TCP connections ([tcp]) and a secure link contradict each other: remove one",
            ));
        }
        if config.interfaces == Interfaces::All {
            config = config.without_udp();
        }
        let key = Key::load(&self.files.key()?).map_err(remedied)?;
        let trust = TrustFile::load(&self.files.trusted_keys()?).map_err(|error| {
            Failure::new(format!("{error}; `jaus keys trust` writes that file"))
        })?;
        let any = || match self.peers.first() {
            Some(Address(SocketAddr::V6(_))) => SocketAddr::from(([0; 16], 0)),
            _ => SocketAddr::from(([0; 4], 0)),
        };
        let listen = self.listen.map_or_else(any, |Address(address)| address);
        let mut settings = jaus_secure::Settings::new(listen);
        for Address(peer) in &self.peers {
            settings = settings.connect(*peer);
        }
        let link = SecureLink::open(&key, trust, settings).map_err(Failure::of)?;
        Ok((config, link))
    }
}

/// A key that is missing is made by a command.
fn remedied(error: jaus_secure::KeyError) -> Failure {
    match &error {
        jaus_secure::KeyError::File { source, .. }
            if source.kind() == std::io::ErrorKind::NotFound =>
        {
            Failure::new(format!("{error}; `jaus keys new` makes one"))
        }
        _ => Failure::of(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_without_a_port_has_the_port_of_secure_links() {
        let address = |text: &str| text.parse::<Address>().map(|Address(it)| it.to_string());
        assert_eq!(address("10.0.0.2").unwrap(), "10.0.0.2:3795");
        assert_eq!(address("10.0.0.2:99").unwrap(), "10.0.0.2:99");
        assert_eq!(address("::1").unwrap(), "[::1]:3795");
        assert!(address("rover").unwrap_err().contains("192.168.7.2"));
    }

    #[test]
    fn plain_udp_remains_only_on_named_interfaces() {
        let folder = tempfile::tempdir().unwrap();
        let [key, trusted] = ["node.key", "trusted_keys"].map(|name| folder.path().join(name));
        Key::create(&key).unwrap();
        std::fs::write(&trusted, "").unwrap();
        let opened = |config: Config| {
            let secure = Secure {
                listen: Some("127.0.0.1:0".parse().unwrap()),
                peers: Vec::new(),
                files: KeyFiles {
                    key: Some(key.clone()),
                    trusted_keys: Some(trusted.clone()),
                },
            };
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build();
            let _guard = runtime.as_ref().unwrap().enter();
            secure.open(config).map(|(config, _)| config.interfaces)
        };
        let none = Interfaces::Only(Vec::new());
        assert_eq!(opened(Config::new(101, 1)).unwrap(), none);
        let named = Config::new(101, 1).interfaces(["lo"]);
        assert_eq!(opened(named.clone()).unwrap(), named.interfaces);
        assert_eq!(
            opened(Config::loopback(101, 1)).unwrap(),
            Interfaces::Loopback
        );
        let tcp = Config::new(101, 1).tcp_listen("127.0.0.1:0".parse().unwrap());
        assert!(opened(tcp).is_err());
    }
}
