//! `jaus-ocu`: the operator's station and its page.

use std::convert::Infallible;
use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus::component::Kind;
use jaus_audit::{AuditLog, Limits};
#[cfg(feature = "https")]
use jaus_cli::https::HttpsFlags;
use jaus_cli::output::Output;
use jaus_cli::{Failure, Ready, launch};
use jaus_ocu::users::UsersFile;
use jaus_ocu::{BaseMap, Listen, Station, Token};
use jaus_vehicle::parts::{Part, PartError, Slot};

#[derive(Args)]
struct Flags {
    /// A vehicle to show, by its subsystem; the first one is selected at the start (repeatable)
    /// [default: all that are discovered]
    #[arg(long, value_name = "SUBSYSTEM", value_parser = clap::value_parser!(u16).range(1..=65534))]
    vehicle: Vec<u16>,

    /// The authority used to request control; the higher authority wins
    #[arg(long, value_name = "CODE", default_value = "200")]
    authority: u8,

    /// Where to serve the page, ADDRESS:PORT; on any other than a loopback address, changing the
    /// vehicle requires a token [default: 127.0.0.1:8080 or the next free port]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,

    /// Read the token from this one-line file and require it on the loopback interface too; it is
    /// never printed [default: a generated token, printed on standard output if one is needed]
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Require the token for viewing too, not only for changes
    #[arg(long)]
    token_to_read: bool,

    /// Require users to log in, each with a role: the file of users that `jaus users` writes
    #[arg(long, value_name = "FILE", conflicts_with_all = ["token_file", "token_to_read"])]
    users: Option<PathBuf>,

    #[cfg(feature = "https")]
    #[command(flatten)]
    https: HttpsFlags,

    /// Log logins, and the requests that change vehicles, as JSON lines in this file
    #[arg(long, value_name = "FILE")]
    audit: Option<PathBuf>,

    /// A host name by which browsers reach this machine, besides its addresses (repeatable)
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,

    /// A geographic map to show behind a vehicle that reports its global pose: a PMTiles file
    /// (version 3) with vector tiles or pictures
    #[arg(long, value_name = "FILE.pmtiles")]
    map: Option<PathBuf>,
}

impl Ready for Flags {
    const PROGRAM: &'static str = "jaus-ocu";
    const ABOUT: &'static str =
        "Operator control unit: watch, control and drive vehicles from a browser";
    const EXAMPLES: &'static str = "Examples:\n  \
        jaus-ocu --loopback                        for a vehicle on this computer\n  \
        jaus-ocu --listen 0.0.0.0:8080             for tablets; prints the address with a token\n  \
        jaus-ocu --listen 0.0.0.0:8080 --token-file /etc/jaus/token --host ocu.local\n  \
        jaus-ocu --listen 0.0.0.0:8443 --https --users ~/.config/jaus/users\n  \
        jaus-ocu --vehicle 101 --vehicle 102 --interface eth0\n  \
        jaus-ocu --map /srv/maps/berlin.pmtiles    behind vehicles with a global pose";
    const ID: JausId = JausId::new(42, 1, 1);
    const KIND: Kind = Kind::OperatorControlUnit;
    const SUBSYSTEM: &'static str = "Operator";

    fn part(self) -> Result<impl Part, Failure> {
        let token = self.token_file.as_deref().map(Token::read).transpose();
        let token = token.map_err(|error| Failure::new(format!("--token-file: {error}")))?;
        let listen = self.listen.map_or(Listen::Loopback, Listen::At);
        let is_loopback = self.listen.is_none_or(|it| it.ip().is_loopback());
        if self.token_to_read && token.is_none() && is_loopback {
            return Err(Failure::new(
                "--token-to-read: the loopback interface has no token without --token-file; name \
                 a file that holds one",
            ));
        }
        let base_map = self.map.as_deref().map(open_map).transpose()?;
        let users = self.users.as_deref().map(open_users).transpose()?;
        let audit = self.audit.as_deref().map(open_audit).transpose()?;
        #[cfg(feature = "https")]
        let tls = self.https.open(&names(listen, &self.host))?;
        #[cfg(not(feature = "https"))]
        let tls = None;
        Ok(Announced(Station {
            vehicles: self.vehicle,
            authority: self.authority,
            listen,
            token,
            token_to_read: self.token_to_read,
            users,
            tls,
            audit,
            hosts: self.host,
            base_map,
        }))
    }
}

/// A station that prints a generated token, and the fingerprint of its own certificate.
struct Announced(Station);

impl Part for Announced {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let station = self.0.open().await?;
        announce(&station.secret_urls());
        if let Some(fingerprint) = station.fingerprint() {
            tracing::info!(
                "compare the SHA-256 fingerprint of the certificate before you trust it: \
                 {fingerprint}"
            );
        }
        station.run(slot).await
    }
}

/// Environment variable of systemd: the output goes to its journal.
const JOURNAL: &str = "JOURNAL_STREAM";

/// Prints the addresses with the token, unless the output is a log.
fn announce(secret_urls: &[String]) {
    if secret_urls.is_empty() {
        return;
    }
    if std::env::var_os(JOURNAL).is_some() && !io::stdout().is_terminal() {
        tracing::warn!(
            "the generated token is not written to the journal: choose one with --token-file"
        );
        return;
    }
    let mut output = Output::new();
    for url in secret_urls {
        // A closed standard output does not stop the station.
        let _ = output.line(format_args!("to control vehicles, open {url}"));
    }
}

fn open_users(path: &Path) -> Result<UsersFile, Failure> {
    let file = UsersFile::load(path).map_err(|error| Failure::new(format!("--users: {error}")))?;
    if file.users().iter().len() == 0 {
        return Err(Failure::new(format!(
            "--users: {} has no users; `jaus users add NAME --role administer --users FILE` adds one",
            path.display()
        )));
    }
    Ok(file)
}

fn open_audit(path: &Path) -> Result<AuditLog, Failure> {
    AuditLog::open(path, Limits::default()).map_err(Failure::of)
}

/// Names and addresses of the page, for a new certificate.
#[cfg(feature = "https")]
fn names(listen: Listen, hosts: &[String]) -> Vec<String> {
    let addresses = listen.addresses().into_iter().map(|it| it.to_string());
    addresses.chain(hosts.iter().cloned()).collect()
}

fn open_map(path: &Path) -> Result<BaseMap, Failure> {
    BaseMap::open(path).map_err(|error| Failure::new(format!("--map {}: {error}", path.display())))
}

fn main() -> ExitCode {
    launch::<Flags>()
}
