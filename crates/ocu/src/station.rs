//! The operator station as a complete component: settings, listening socket and main loop.

use std::convert::Infallible;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use tokio::net::TcpListener;

use super::base_map::BaseMap;
use super::server::{Admission, Devices, Gate, MemoryBrowsers, Proofs, Server, Trail, UserGate};
use super::session::Session;
use super::tls::Tls;
use super::token::Token;
use super::users::UsersFile;
use jaus::link::interface;
use jaus_audit::AuditLog;
use jaus_vehicle::parts::{Part, PartError, Slot};

/// An operator station with its page.
///
/// ```no_run
/// # use jaus::component::Kind;
/// # use jaus::node::{Config, Node};
/// # use jaus_ocu::Station;
/// # use jaus_vehicle::parts::{Part, Slot};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::new(42, 1))?;
/// let slot = Slot::new(node.attach(1)?, node, Kind::OperatorControlUnit, "Operator");
/// let station = Station { vehicles: vec![101], ..Station::default() }.open().await?;
/// println!("the page is at {}", station.secret_urls().join(" "));
/// station.run(slot).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Station {
    /// The vehicles to show, by subsystem number; the first is selected at the start. Empty for all
    /// that are discovered.
    pub vehicles: Vec<u16>,
    /// Authority for control requests, 0 to 255.
    pub authority: u8,
    /// Address of the page.
    pub listen: Listen,
    /// The token an operator must show before the vehicle obeys. Without one, one is generated, and
    /// kept in [`state`](Self::state) unless another program has the usual port.
    pub token: Option<Token>,
    /// Whether looking and stopping also require the token.
    pub token_to_read: bool,
    /// Whether no token is required: every user and program of this host may drive. It applies to
    /// the loopback interface alone.
    pub unprotected: bool,
    /// The folder for the generated token and the known devices of users, which remain when the
    /// station is restarted. Without it they do not.
    pub state: Option<PathBuf>,
    /// The users of the page, who must log in to see anything. They replace the token.
    pub users: Option<UsersFile>,
    /// The certificate of the page. Without one it is served unencrypted.
    pub tls: Option<Tls>,
    /// The log of logins, and of requests that change vehicles.
    pub audit: Option<AuditLog>,
    /// Host names of the page, in addition to `localhost` and the addresses of this machine.
    pub hosts: Vec<String>,
    /// The geographic map behind a vehicle that reports its global pose.
    pub base_map: Option<BaseMap>,
}

/// Address of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Listen {
    /// The loopback interface, at port 8080 or the next free port.
    Loopback,
    /// A given address; port 0 selects any free port.
    At(SocketAddr),
}

impl Listen {
    /// First port to try.
    const PORT: u16 = 8080;
    /// Number of further ports to try.
    const PORTS: u16 = 20;

    /// The addresses at which browsers reach the page.
    #[must_use]
    pub fn addresses(self) -> Vec<IpAddr> {
        match self {
            Self::Loopback => vec![Ipv4Addr::LOCALHOST.into()],
            Self::At(address) if address.ip().is_unspecified() => own_addresses(),
            Self::At(address) => vec![address.ip()],
        }
    }
}

impl Default for Station {
    /// All vehicles that are discovered, authority 200, on the loopback interface only, with a
    /// generated token.
    fn default() -> Self {
        Self {
            vehicles: Vec::new(),
            authority: 200,
            listen: Listen::Loopback,
            token: None,
            token_to_read: true,
            unprotected: false,
            state: None,
            users: None,
            tls: None,
            audit: None,
            hosts: Vec::new(),
            base_map: None,
        }
    }
}

impl Station {
    /// Opens the listening socket. Pages reach the session once the station runs.
    ///
    /// # Errors
    /// If listening at the address fails, another address than loopback would be unprotected, or
    /// there is no usable token.
    pub async fn open(mut self) -> Result<OpenStation, PartError> {
        let (listener, is_moved) = listen(self.listen).await?;
        let address = listener.local_addr().map_err(broken)?;
        if is_moved {
            tracing::warn!(
                "another program has port {}: the page is at {address}; a token that was kept is not used there",
                Listen::PORT
            );
        }
        if self.unprotected && !address.ip().is_loopback() {
            return Err(PartError::Broken(format!(
                "{address} is reached from other hosts: it requires a token or users"
            )));
        }
        let generates_token = self.token.is_none() && self.users.is_none() && !self.unprotected;
        // Another program has the usual port, and may wait there for the kept token.
        let folder = self.state.as_ref().filter(|_| generates_token && !is_moved);
        let token_file = folder.map(|it| it.join(TOKEN_FILE));
        if generates_token {
            let token = match &token_file {
                Some(file) => Token::keep(file),
                None => Token::generate(),
            };
            self.token = Some(token.map_err(broken)?);
        }
        Ok(OpenStation {
            station: self,
            generates_token,
            token_file,
            listener,
            address,
        })
    }

    /// Runs without a socket, for browsers that are simulated in this process, on the clock of the
    /// tokio runtime. Each is a stream of octets and its address.
    ///
    /// # Errors
    /// If the component cannot start or continue.
    #[doc(hidden)]
    pub async fn run_in_memory(
        self,
        slot: Slot,
        browsers: MemoryBrowsers,
    ) -> Result<Infallible, PartError> {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, Listen::PORT));
        let (session, server) = self.start(slot, address)?;
        tokio::select! {
            error = session.run() => Err(error),
            () = server.run_in_memory(browsers) => Err(server_has_ended()),
        }
    }

    /// Starts the component. The page is at `address`.
    fn start(self, slot: Slot, address: SocketAddr) -> Result<(Session, Server), PartError> {
        let node = slot.node.clone();
        let component = slot.component("Operator").live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let trail = Trail::new(self.audit, component.id());
        let gate = match (self.users, self.token) {
            (Some(users), _) => {
                let is_secure = self.tls.is_some();
                let file =
                    |folder: PathBuf| folder.join(format!("page-{}.devices", address.port()));
                Gate::Users(Box::new(UserGate::new(
                    users,
                    Devices::load(self.state.map(file)),
                    address.port(),
                    is_secure,
                    trail.clone(),
                )))
            }
            (None, Some(token)) => Gate::Token {
                token,
                to_read: self.token_to_read,
            },
            (None, None) => {
                tracing::warn!(
                    "the page is unprotected: every user and program of this host may drive vehicles"
                );
                Gate::Open
            }
        };
        let is_secure = self.tls.is_some();
        let proofs = Proofs::new(address.port(), is_secure, &self.hosts).map_err(broken)?;
        let admission = Admission {
            operator: component.id(),
            authority: self.authority,
            gate,
            proofs,
            trail,
            hosts: self.hosts,
            base_map: self.base_map,
            node,
        };
        let (session, access) = Session::new(component, self.vehicles, self.authority);
        Ok((session, Server::new(admission, access)))
    }
}

/// Name of the file with the generated token.
const TOKEN_FILE: &str = "page.token";

/// A station with an open listening socket.
#[derive(Debug)]
pub struct OpenStation {
    station: Station,
    /// Whether the token was generated, at this start or at an earlier one.
    generates_token: bool,
    /// The file with the generated token, if it is kept.
    token_file: Option<PathBuf>,
    listener: TcpListener,
    address: SocketAddr,
}

impl OpenStation {
    /// The listening address.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// URLs of the page, without a token.
    #[must_use]
    pub fn urls(&self) -> Vec<String> {
        self.urls_with("")
    }

    /// URLs of the page with the generated token; none if the token came from the caller. They are
    /// for the user who starts the station, not for a log.
    #[must_use]
    pub fn secret_urls(&self) -> Vec<String> {
        match &self.station.token {
            Some(token) if self.generates_token => {
                self.urls_with(&format!("#token={}", token.reveal()))
            }
            _ => Vec::new(),
        }
    }

    /// The file with the generated token, if it is kept.
    #[must_use]
    pub fn token_file(&self) -> Option<&Path> {
        self.token_file.as_deref()
    }

    fn urls_with(&self, token: &str) -> Vec<String> {
        let port = self.address.port();
        let scheme = if self.station.tls.is_some() {
            "https"
        } else {
            "http"
        };
        let addresses = Listen::At(self.address).addresses();
        let urls = addresses.into_iter().map(|ip| {
            let address = SocketAddr::new(ip, port);
            format!("{scheme}://{address}/{token}")
        });
        urls.collect()
    }

    /// The fingerprint of a certificate that the station has made itself, for the operator to
    /// compare.
    #[must_use]
    pub fn fingerprint(&self) -> Option<&str> {
        let tls = self.station.tls.as_ref();
        tls.filter(|it| it.is_self_signed()).map(Tls::fingerprint)
    }
}

impl Part for Station {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        self.open().await?.run(slot).await
    }
}

impl Part for OpenStation {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        for url in self.urls() {
            tracing::info!("the operator's page is at {url}");
        }
        let Self {
            station,
            listener,
            address,
            ..
        } = self;
        if station.tls.is_none() && !address.ip().is_loopback() {
            tracing::warn!(
                "the page is not encrypted: passwords and tokens can be read on its network; \
                 --https encrypts it"
            );
        }
        let tls = station.tls.clone();
        let (session, server) = station.start(slot, address)?;
        tokio::select! {
            error = session.run() => Err(error),
            () = server.run(listener, tls) => Err(server_has_ended()),
        }
    }
}

fn broken(error: impl std::fmt::Display) -> PartError {
    PartError::Broken(error.to_string())
}

fn server_has_ended() -> PartError {
    PartError::Broken("the page's server has ended".to_owned())
}

/// Listens, and says whether the usual port belongs to another program.
async fn listen(listen: Listen) -> Result<(TcpListener, bool), PartError> {
    let broken = |address: SocketAddr, error: std::io::Error| {
        PartError::Broken(format!(
            "cannot serve the page at {address} (--listen): {error}; choose another address or port"
        ))
    };
    match listen {
        Listen::At(address) => {
            let listener = TcpListener::bind(address).await;
            let listener = listener.map_err(|error| broken(address, error))?;
            Ok((listener, false))
        }
        Listen::Loopback => {
            let mut port = Listen::PORT;
            loop {
                let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
                match TcpListener::bind(address).await {
                    Ok(listener) => return Ok((listener, port != Listen::PORT)),
                    Err(_) if port < Listen::PORT + Listen::PORTS => port += 1,
                    Err(error) => return Err(broken(address, error)),
                }
            }
        }
    }
}

/// The addresses of this machine that others may reach, or else the loopback address.
fn own_addresses() -> Vec<IpAddr> {
    const MOST: usize = 4;
    let all = interface::list().unwrap_or_default();
    let reachable = all.iter().map(|interface| interface.address);
    let reachable = reachable.filter(|ip| ip.is_ipv4() && !ip.is_loopback());
    let mut addresses: Vec<_> = reachable.take(MOST).collect();
    if addresses.is_empty() {
        addresses.push(Ipv4Addr::LOCALHOST.into());
    }
    addresses
}
