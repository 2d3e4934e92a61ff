//! `jaus-ocu`: the operator's station and its page.

use std::convert::Infallible;
use std::env;
use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jaus::address::JausId;
use jaus::component::Kind;
use jaus_audit::AuditLog;
use jaus_cli::folders::{make_folder_of, service_folder};
#[cfg(feature = "https")]
use jaus_cli::https::HttpsFlags;
use jaus_cli::output::{OUTPUT_IS_LOG, Output};
use jaus_cli::{Failure, Ready, launch};
use jaus_ocu::users::UsersFile;
use jaus_ocu::{BaseMap, Listen, OpenStation, Station, Token};
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

    /// Where to serve the page, ADDRESS:PORT [default: 127.0.0.1:8080 or the next free port]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,

    /// Read the page's token from this one-line file; it is never printed [default: a generated
    /// token, kept in `page.token` beside the user's keys, and printed on standard output with the
    /// address]
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Let pages without the token look, and stop vehicles
    #[arg(long)]
    watch_without_token: bool,

    /// Require no token: every user and program of this computer can drive the vehicles; only for a
    /// loopback address
    #[arg(long, conflicts_with_all = ["token_file", "watch_without_token"])]
    unprotected: bool,

    /// Require users to log in, each with a role: the file of users that `jaus users` writes
    #[arg(long, value_name = "FILE", conflicts_with_all = ["token_file", "watch_without_token", "unprotected"])]
    users: Option<PathBuf>,

    #[cfg(feature = "https")]
    #[command(flatten)]
    https: HttpsFlags,

    /// Logins, and the requests that change vehicles.
    #[arg(skip)]
    audit: Option<AuditLog>,

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
        jaus-ocu --listen 0.0.0.0:8080             for tablets\n  \
        jaus-ocu --listen 0.0.0.0:8080 --token-file /etc/jaus/token --host ocu.local\n  \
        jaus-ocu --listen 0.0.0.0:8443 --https --users ~/.config/jaus/users\n  \
        jaus-ocu --vehicle 101 --vehicle 102 --interface eth0\n  \
        jaus-ocu --map /srv/maps/berlin.pmtiles    behind vehicles with a global pose";
    const ID: JausId = JausId::new(42, 1, 1);
    const KIND: Kind = Kind::OperatorControlUnit;
    const SUBSYSTEM: &'static str = "Operator";
    const AUDITS: bool = true;

    fn audit(&mut self, log: Option<AuditLog>) {
        self.audit = log;
    }

    fn part(self) -> Result<impl Part, Failure> {
        let token = self.token_file.as_deref().map(Token::read).transpose();
        let token = token.map_err(|error| Failure::new(format!("--token-file: {error}")))?;
        let listen = self.listen.map_or(Listen::Loopback, Listen::At);
        let is_loopback = self.listen.is_none_or(|it| it.ip().is_loopback());
        if self.unprotected && !is_loopback {
            return Err(Failure::new(
                "--unprotected: other hosts reach this address; it needs the token or --users",
            ));
        }
        let base_map = self.map.as_deref().map(open_map).transpose()?;
        let users = self.users.as_deref().map(open_users).transpose()?;
        #[cfg(feature = "https")]
        let tls = self.https.open(&names(listen, &self.host))?;
        #[cfg(not(feature = "https"))]
        let tls = None;
        Ok(Announced(Station {
            vehicles: self.vehicle,
            authority: self.authority,
            listen,
            token,
            token_to_read: !self.watch_without_token,
            unprotected: self.unprotected,
            state: state_folder(),
            users,
            tls,
            audit: self.audit,
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
        announce(&station);
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
fn announce(station: &OpenStation) {
    let secret_urls = station.secret_urls();
    if secret_urls.is_empty() {
        return;
    }
    let is_log = [JOURNAL, OUTPUT_IS_LOG]
        .map(env::var_os)
        .iter()
        .any(Option::is_some);
    if is_log && !io::stdout().is_terminal() {
        let place = match station.token_file() {
            Some(file) => format!("it is in {}", file.display()),
            None => "choose one with --token-file".to_owned(),
        };
        tracing::warn!("the page's token is not written to the log: {place}");
        return;
    }
    let mut output = Output::new();
    for url in secret_urls {
        // A closed standard output does not stop the station.
        let _ = output.line(format_args!("to control vehicles, open {url}"));
    }
}

/// The folder for what the station keeps; `None`, with a warning, if there is none.
fn state_folder() -> Option<PathBuf> {
    let folder = service_folder()?;
    match make_folder_of(&folder.join("page")) {
        Ok(()) => Some(folder),
        Err(error) => {
            tracing::warn!("the page's token and known devices are not kept: {error}");
            None
        }
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
