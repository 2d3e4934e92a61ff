//! Flags and settings of the secure link: this node's key, the keys that it trusts, and the peers.

mod files;

use std::net::{IpAddr, SocketAddr};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::SystemTime;

use clap::Args;
use jaus::address::JausId;
use jaus::link::{Interface, Interfaces, Ip, interface};
use jaus::node::{Config, Tcp, units};
use jaus::rights::{self, RuleError, Rules};
use jaus_audit::AuditLog;
use jaus_secure::{Announce, Credentials, Key, Peer, SecureLink, Trust, TrustFile, edit};
use serde::Deserialize;

use files::Certificates;
pub use files::KeyFiles;

use super::failure::Failure;
use super::permissions::table_with;
use super::settings;

/// The UDP port of secure links.
pub const PORT: u16 = 3795;

/// The value of `--secure-announce` without an interface.
const EVERYWHERE: &str = "all";

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

/// Octets per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
struct Budget(NonZeroU32);

/// With less, handshakes and keep-alives alone would use up the budget.
const LEAST_BUDGET: u32 = 5000;

impl FromStr for Budget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let size = text.strip_suffix("/s").and_then(|it| units::size(it).ok());
        let octets = size.and_then(|octets| u32::try_from(octets).ok());
        let octets = octets.filter(|&octets| octets >= LEAST_BUDGET);
        octets.and_then(NonZeroU32::new).map(Self).ok_or_else(|| {
            format!(
                "`{text}` is not a rate from 5 kB/s to 4 GB/s: write \"200 kB/s\" or \"1.5 MB/s\""
            )
        })
    }
}

impl TryFrom<String> for Budget {
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

    /// At the first start, trust this key for these ids: NAME, KEY and IDS, separated by blanks
    /// (repeatable)
    ///
    /// It writes the file of trusted keys if there is none. A key that is missing from an existing
    /// file may have been revoked: then the start fails, and `jaus keys trust` adds the key.
    #[arg(long, value_name = "PEER")]
    trust: Vec<Peer>,

    /// Find peers that trust this node's key on this network, and be found by them, by signed
    /// beacons; an interface limits them to its network [default: all interfaces] (repeatable)
    #[arg(
        long,
        value_name = "INTERFACE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = EVERYWHERE,
    )]
    secure_announce: Vec<String>,

    /// Send at most this much per second by the secure link, such as "200 kB/s"
    #[arg(long, value_name = "RATE")]
    secure_budget: Option<Budget>,

    /// Decide on messages of one's own, too, by what the JSIDL file or directory states of them
    /// (repeatable)
    #[arg(long, value_name = "PATH")]
    secure_jsidl: Vec<PathBuf>,

    #[command(flatten)]
    files: KeyFiles,

    #[command(flatten)]
    certificates: Certificates,
}

/// The table `[secure]` of a settings file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Table {
    /// Accept secure links at this address, by default on port 3795. Flag: `--secure-listen`.
    listen: Option<Address>,
    /// Connect to these peers. Flag: `--secure-peer`.
    peers: Vec<Address>,
    /// Find peers by signed beacons, and be found by them: `true` for all interfaces, or names such
    /// as `["eth0"]`. Flag: `--secure-announce`.
    announce: Beacons,
    /// The most octets to send per second on all sessions together, such as `"200 kB/s"`. The most
    /// urgent messages come first. Flag: `--secure-budget`.
    budget: Option<Budget>,
    /// The file of this node's key. Flag: `--key`.
    key: Option<PathBuf>,
    /// The file of the keys that this node trusts. Flag: `--trusted-keys`.
    trusted_keys: Option<PathBuf>,
    /// The people of whom two must have signed each line of the trusted keys; by default `approvers` beside
    /// those, if it is there. Flag: `--approvers`.
    approvers: Option<PathBuf>,
    /// The file of this node's certificate, with which it accepts peers by theirs instead of by
    /// trusted keys. Flag: `--certificate`.
    certificate: Option<PathBuf>,
    /// The certificate of the authority; by default `ca.crt` beside the node's. Flag:
    /// `--certificate-authority`.
    authority: Option<PathBuf>,
    /// The authority's list of revoked certificates. Flag: `--revoked`.
    revoked: Option<PathBuf>,
    /// JSIDL files or folders of messages of one's own, which state what their senders need. Flag:
    /// `--secure-jsidl`.
    jsidl: Vec<PathBuf>,
}

/// The interfaces to send beacons on.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(
    untagged,
    expecting = "true, false, or a list of interfaces such as [\"eth0\"]"
)]
enum Beacons {
    OnAll(bool),
    On(Vec<String>),
}

impl Default for Beacons {
    fn default() -> Self {
        Self::OnAll(false)
    }
}

impl Beacons {
    /// Those of the flags, or else of the settings file; `None` for no beacons.
    fn interfaces(self, flags: &[String]) -> Option<Interfaces> {
        match (flags, self) {
            ([], Self::OnAll(false)) => None,
            ([], Self::On(names)) if names.is_empty() => None,
            ([], Self::On(names)) => Some(Interfaces::Only(names)),
            ([], Self::OnAll(true)) => Some(Interfaces::All),
            (flags, _) if flags.iter().any(|it| it == EVERYWHERE) => Some(Interfaces::All),
            (flags, _) => Some(Interfaces::Only(flags.to_vec())),
        }
    }
}

/// The settings of a secure link.
#[derive(Debug)]
pub struct Secure {
    listen: Option<Address>,
    peers: Vec<Address>,
    /// To be trusted at the first start.
    trust: Vec<Peer>,
    announce: Option<Interfaces>,
    budget: Option<Budget>,
    jsidl: Vec<PathBuf>,
    files: KeyFiles,
    certificates: Certificates,
}

impl SecureFlags {
    /// The settings from flags and the settings file; `None` if neither asks for a secure link.
    ///
    /// # Errors
    /// An unreadable file, an invalid table, or a key to trust without a secure link.
    pub fn settings(&self, file: Option<&Path>) -> Result<Option<Secure>, Failure> {
        let table: Table = file
            .map(|file| settings::section(file, settings::SECURE))
            .transpose()?
            .unwrap_or_default();
        let secure = Secure {
            listen: self.secure_listen.or(table.listen),
            peers: [&table.peers[..], &self.secure_peer].concat(),
            trust: self.trust.clone(),
            announce: table.announce.interfaces(&self.secure_announce),
            budget: self.secure_budget.or(table.budget),
            jsidl: [&table.jsidl[..], &self.secure_jsidl].concat(),
            files: KeyFiles {
                key: self.files.key.clone().or(table.key),
                trusted_keys: self.files.trusted_keys.clone().or(table.trusted_keys),
                approvers: self.files.approvers.clone().or(table.approvers),
            },
            certificates: {
                let flags = self.certificates.clone();
                Certificates {
                    certificate: flags.certificate.or(table.certificate),
                    authority: flags.authority.or(table.authority),
                    revoked: flags.revoked.or(table.revoked),
                }
            },
        };
        let is_wanted =
            secure.listen.is_some() || !secure.peers.is_empty() || secure.announce.is_some();
        if !is_wanted && !secure.trust.is_empty() {
            return Err(Failure::new(
                "--trust is for a secure link: add --secure-listen, or --secure-peer ADDRESS",
            ));
        }
        if secure.uses_certificates() && (!secure.trust.is_empty() || secure.announce.is_some()) {
            return Err(Failure::new(
                "--trust and announcing are for nodes that trust keys: omit them, or the certificate",
            ));
        }
        Ok(is_wanted.then_some(secure))
    }
}

impl Secure {
    /// This node's key.
    ///
    /// # Errors
    /// If its file cannot be used.
    pub fn key(&self) -> Result<Key, Failure> {
        Key::load(&self.files.key()?).map_err(remedied)
    }

    /// The keys that this node trusts.
    ///
    /// # Errors
    /// If their file cannot be used.
    pub fn trust(&self) -> Result<TrustFile, Failure> {
        let path = self.files.trusted_keys()?;
        if let Some(approvers) = self.files.approvers()? {
            return TrustFile::load_controlled(&path, &approvers).map_err(Failure::of);
        }
        if self.uses_certificates() {
            if self.files.trusted_keys.is_some() && !path.exists() {
                tracing::warn!(file = %path.display(), "missing, so no line narrows a certificate");
            }
            return TrustFile::load_optional(&path).map_err(Failure::of);
        }
        TrustFile::load(&path)
            .map_err(|error| Failure::new(format!("{error}; `jaus keys trust` writes that file")))
    }

    /// Whether this node uses certificates instead of trusted keys.
    pub const fn uses_certificates(&self) -> bool {
        self.certificates.certificate.is_some()
    }

    /// This node's key, and how it accepts those of its peers.
    ///
    /// # Errors
    /// If a file cannot be used, or the node's own certificate is not valid.
    #[expect(
        clippy::disallowed_methods,
        reason = "the node's certificate has to be valid when the node starts"
    )]
    pub fn credentials(&self) -> Result<Credentials, Failure> {
        // A key that cannot be used is named with its remedy.
        self.key()?;
        let (key, trust) = (self.files.key()?, self.trust()?);
        match self.certificates.files()? {
            Some(files) => Credentials::load_certified(&key, &files, trust, SystemTime::now())
                .map_err(Failure::of),
            None => Credentials::load(&key, trust).map_err(Failure::of),
        }
    }

    /// The addresses of the peers to connect to.
    pub fn peers(&self) -> Vec<SocketAddr> {
        self.peers.iter().map(|Address(peer)| *peer).collect()
    }

    /// Whether the link connects to peers, and several programs may have the same settings at once.
    pub fn only_dials(&self) -> bool {
        let is_dialling = !self.peers.is_empty() && self.announce.is_none();
        is_dialling && self.listen.is_none()
    }

    /// The node's settings beside the link: plain JUDP and JTCP only on interfaces that they name.
    ///
    /// # Errors
    /// Plain TCP connections that are not on these interfaces, or interfaces that cannot be listed.
    pub fn restrict(config: Config) -> Result<Config, Failure> {
        let named = match config.interfaces {
            Interfaces::All => Vec::new(),
            _ => {
                let all = interface::list().map_err(Failure::of)?;
                config.interfaces.present(&all, Ip::Both)
            }
        };
        if let Some(address) = outside(&config.tcp, &named) {
            return Err(Failure::new(format!(
                "plain TCP at {address} and a secure link contradict each other: remove it from \
                 [tcp], or name its interface by `interfaces`, which others must not share"
            )));
        }
        match config.interfaces {
            Interfaces::All => Ok(config.without_udp()),
            _ => Ok(config),
        }
    }

    /// Opens the link of this node, an id without a component. It writes to the log, if there is one.
    ///
    /// # Errors
    /// A key, certificate or trust file that cannot be used, or an address that cannot be listened on.
    pub fn open(&self, node: JausId, log: Option<AuditLog>) -> Result<SecureLink, Failure> {
        let table = table_with(&self.jsidl)?;
        // Before the file is written.
        known_names(&TrustFile::of(Trust::new(self.trust.clone())), &table)?;
        if self.files.approvers()?.is_none() {
            trust_at_first_start(&self.files.trusted_keys()?, &self.trust)?;
        } else if !self.trust.is_empty() {
            return Err(Failure::new(
                "--trust adds keys alone, and here two people must approve them: use `jaus keys trust`",
            ));
        }
        let credentials = self.credentials()?;
        let any = || match self.peers.first() {
            Some(Address(SocketAddr::V6(_))) => SocketAddr::from(([0; 16], 0)),
            _ => SocketAddr::from(([0; 4], 0)),
        };
        let listen = self.listen.map_or_else(any, |Address(address)| address);
        known_names(&self.trust()?, &table)?;
        let mut settings = jaus_secure::Settings::new(listen).table(table);
        for peer in self.peers() {
            settings = settings.connect(peer);
        }
        if let Some(interfaces) = self.announce.clone() {
            settings = settings.announce(Announce { interfaces, node });
        }
        if let Some(Budget(octets)) = self.budget {
            settings = settings.budget(octets);
        }
        let link = SecureLink::open_with(credentials, settings).map_err(Failure::of)?;
        Ok(match log {
            Some(log) => link.audited(log),
            None => link,
        })
    }
}

/// Checks that the definitions in use have the names in the rules of the peers. Other faults of the rules are
/// logged while the node runs.
fn known_names(trust: &TrustFile, table: &rights::Table) -> Result<(), Failure> {
    match trust.verify(table) {
        Err((peer, error @ RuleError::Name(_))) => Err(Failure::new(format!(
            "the rules of the trusted peer `{peer}`: {error}. Definitions of your own are named by \
             --secure-jsidl"
        ))),
        _ => Ok(()),
    }
}

/// The first address of these TCP settings that is not on one of the interfaces.
fn outside(tcp: &Tcp, interfaces: &[Interface]) -> Option<SocketAddr> {
    let is_own = |at: &SocketAddr| interfaces.iter().any(|i| i.address == at.ip());
    let is_reached = |peer: &SocketAddr| interfaces.iter().any(|i| i.reaches(*peer));
    let mut peers = tcp.connect.iter().map(|peer| peer.address());
    let listen = tcp.listen.filter(|at| !is_own(at));
    listen.or_else(|| peers.find(|peer| !is_reached(peer)))
}

/// Writes a trust file with these peers if there is none. An existing file must trust them for the same ids
/// and with the same rules: it is not changed, or a restart with the same flags would undo a revocation; and
/// narrower rules must not be ignored.
fn trust_at_first_start(file: &Path, peers: &[Peer]) -> Result<(), Failure> {
    if !file.exists() {
        let mut each = peers.iter();
        return each.try_for_each(|peer| edit::trust(file, peer, false).map_err(Failure::of));
    }
    if peers.is_empty() {
        return Ok(());
    }
    let trust = TrustFile::load(file).map_err(Failure::of)?;
    peers
        .iter()
        .try_for_each(|peer| match trust.find(peer.key) {
            Some(known) if known.ids == peer.ids && known.rules == peer.rules => Ok(()),
            Some(known) if known.ids == peer.ids => Err(other_rules(file, &known, peer)),
            _ => Err(untrusted(file, peer)),
        })
}

fn other_rules(file: &Path, known: &Peer, peer: &Peer) -> Failure {
    let file = file.display();
    let words = |rules: &Rules| match rules.to_string() {
        none if none.is_empty() => "observe".to_owned(),
        words => words,
    };
    let (name, has, wants) = (&known.name, words(&known.rules), words(&peer.rules));
    Failure::new(format!(
        "{file} says `{has}` of the key of `{name}`, but --trust says `{wants}`: run `jaus keys allow {name} \
         {wants}`, or correct --trust"
    ))
}

fn untrusted(file: &Path, peer: &Peer) -> Failure {
    let (file, name, key, rules) = (file.display(), &peer.name, &peer.key, &peer.rules);
    let ids: Vec<_> = peer.ids.iter().map(JausId::to_string).collect();
    let ids = ids.join(",");
    let remedy = format!("jaus keys trust {name} {key} {ids} {rules}");
    let remedy = remedy.trim_end();
    Failure::new(format!(
        "{file} does not trust the key of `{name}` for {ids}, which --trust names: was it revoked? Omit \
         --trust, or run `{remedy}`"
    ))
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
    fn a_restart_with_the_same_flags_does_not_undo_a_revocation() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("trusted_keys");
        let key = format!("{}=", "A".repeat(43));
        let operator: Peer = format!("operator {key} 60.255.255").parse().unwrap();
        let peers = std::slice::from_ref(&operator);
        trust_at_first_start(&file, &[]).unwrap();
        assert!(!file.exists(), "no peer, no file");
        for _ in 0..2 {
            trust_at_first_start(&file, peers).unwrap();
        }
        let trust = TrustFile::load(&file).unwrap();
        assert_eq!(trust.find(operator.key), Some(operator.clone()));

        edit::revoke(&file, "operator", None).unwrap();
        let refused = trust_at_first_start(&file, peers).unwrap_err().to_string();
        let remedy = format!("jaus keys trust operator {key} 60.255.255");
        assert!(refused.contains(&remedy), "{refused}");
        assert_eq!(TrustFile::load(&file).unwrap().find(operator.key), None);
    }

    #[test]
    fn a_restart_with_other_rules_for_a_key_is_refused_and_names_the_command() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("trusted_keys");
        let peer = |rules: &str| -> [Peer; 1] {
            let key = format!("{}=", "A".repeat(43));
            let peer = format!("operator {key} 60.255.255 {rules}");
            [peer.parse().unwrap()]
        };
        trust_at_first_start(&file, &peer("control=127")).unwrap();
        trust_at_first_start(&file, &peer("control=127")).unwrap();
        let narrower = peer("observe");
        let refused = trust_at_first_start(&file, &narrower);
        let refused = refused.unwrap_err().to_string();
        assert!(
            refused.contains("jaus keys allow operator observe"),
            "{refused}"
        );
        assert!(refused.contains("control=127"), "{refused}");
        assert!(edit::allow(&file, "operator", &narrower[0].rules).unwrap());
        trust_at_first_start(&file, &narrower).unwrap();
    }

    #[test]
    fn beacons_are_sent_on_all_interfaces_or_on_the_named_ones() {
        let only = |name: &str| Some(Interfaces::Only(vec![name.to_owned()]));
        let from = |table: &str, flags: &[&str]| {
            let table: Table = toml::from_str(table).unwrap();
            let flags: Vec<_> = flags.iter().map(|&it| it.to_owned()).collect();
            table.announce.interfaces(&flags)
        };
        assert_eq!(from("", &[]), None);
        assert_eq!(from("announce = false", &[]), None);
        assert_eq!(from("announce = []", &[]), None);
        assert_eq!(from("announce = true", &[]), Some(Interfaces::All));
        assert_eq!(from("announce = ['eth0']", &[]), only("eth0"));
        assert_eq!(from("announce = ['eth0']", &["eth1"]), only("eth1"));
        assert_eq!(from("", &[EVERYWHERE]), Some(Interfaces::All));
        let error = toml::from_str::<Table>("announce = 3").unwrap_err();
        assert!(error.to_string().contains("[\"eth0\"]"), "{error}");
    }

    #[test]
    fn a_budget_is_a_size_for_each_second() {
        let budget = |text: &str| text.parse::<Budget>().map(|Budget(octets)| octets.get());
        assert_eq!(budget("200 kB/s"), Ok(200_000));
        assert_eq!(budget("1.5MiB/s"), Ok(3 << 19));
        for text in [
            "", "200 kB", "200", "0/s", "1 kB/s", "5 GB/s", "kB/s", "-1 kB/s",
        ] {
            let error = budget(text).unwrap_err();
            assert!(error.contains("200 kB/s"), "{error}");
        }
    }

    #[test]
    fn plain_tcp_remains_only_on_named_interfaces() {
        let accepts = |config: Config, listen: &str| {
            Secure::restrict(config.tcp_listen(listen.parse().unwrap())).is_ok()
        };
        let connects = |config: Config, peer: &str| {
            Secure::restrict(config.tcp_connect(peer.parse().unwrap())).is_ok()
        };
        let named = || Config::new(101, 1).interfaces(["lo"]);
        assert!(accepts(named(), "127.0.0.1:0") && connects(named(), "127.0.0.1:3794"));
        assert!(accepts(Config::loopback(101, 1), "127.0.0.1:0"));
        assert!(!accepts(named(), "0.0.0.0:3794") && !accepts(named(), "192.0.2.1:3794"));
        assert!(!connects(named(), "192.0.2.1:3794"));
        let unnamed = || Config::new(101, 1);
        assert!(!accepts(unnamed(), "127.0.0.1:0") && !connects(unnamed(), "127.0.0.1:3794"));
    }

    #[test]
    fn plain_udp_remains_only_on_named_interfaces() {
        let restricted = |config| Secure::restrict(config).map(|it| it.interfaces);
        let none = Interfaces::Only(Vec::new());
        assert_eq!(restricted(Config::new(101, 1)).unwrap(), none);
        let named = Config::new(101, 1).interfaces(["lo"]);
        assert_eq!(restricted(named.clone()).unwrap(), named.interfaces);
        assert_eq!(
            restricted(Config::loopback(101, 1)).unwrap(),
            Interfaces::Loopback
        );
    }
}
