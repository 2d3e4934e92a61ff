//! The operator's station as a ready component: settings, the listening socket, and the run.

use std::convert::Infallible;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use tokio::net::TcpListener;

use super::server::{Admission, Server};
use super::session::Session;
use super::token::Token;
use jaus::link::interface;
use jaus_vehicle::parts::{Part, PartError, Slot};

/// An operator's station, with its page.
#[derive(Debug, Clone)]
pub struct Station {
    /// The vehicle to look at; the first that is discovered without one.
    pub vehicle: Option<u16>,
    /// With which authority it asks for control, 0 to 255.
    pub authority: u8,
    /// Where the page is.
    pub listen: Listen,
    /// What an operator has to show before the vehicle obeys. Without one, nothing is needed on the
    /// loopback interface, and one is made up elsewhere.
    pub token: Option<Token>,
    /// Whether the token is needed to look, too.
    pub token_to_read: bool,
    /// Names under which the page is known, beside `localhost` and the addresses of this machine.
    pub hosts: Vec<String>,
}

/// Where a page is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Listen {
    /// On the loopback interface, at port 8080 or the next that is free.
    Loopback,
    /// At an address; port 0 stands for any that is free.
    At(SocketAddr),
}

impl Listen {
    /// The first port that is tried …
    const PORT: u16 = 8080;
    /// … and how many after it.
    const PORTS: u16 = 20;
}

impl Default for Station {
    /// The first vehicle, with the authority 200, for people at this machine alone.
    fn default() -> Self {
        Self {
            vehicle: None,
            authority: 200,
            listen: Listen::Loopback,
            token: None,
            token_to_read: false,
            hosts: Vec::new(),
        }
    }
}

impl Station {
    /// Listens for pages, which reach the session once the station runs.
    ///
    /// # Errors
    /// If the address can not be listened at.
    pub async fn open(mut self) -> Result<OpenStation, PartError> {
        let listener = listen(self.listen).await?;
        let address = listener
            .local_addr()
            .map_err(|error| PartError::Broken(error.to_string()))?;
        if self.token.is_none() && !address.ip().is_loopback() {
            let made_up = Token::generate();
            self.token = Some(made_up.map_err(|error| PartError::Broken(error.to_string()))?);
        }
        Ok(OpenStation {
            station: self,
            listener,
            address,
        })
    }
}

/// A station whose address is known.
#[derive(Debug)]
pub struct OpenStation {
    station: Station,
    listener: TcpListener,
    address: SocketAddr,
}

impl OpenStation {
    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Addresses of the page, with the token if one is needed: for whoever starts the station.
    #[must_use]
    pub fn urls(&self) -> Vec<String> {
        let token = self.station.token.as_ref();
        let token = token.map_or_else(String::new, |it| format!("#token={}", it.reveal()));
        let port = self.address.port();
        let url = |ip: IpAddr| format!("http://{}/{token}", SocketAddr::new(ip, port));
        if self.address.ip().is_unspecified() {
            own_addresses().into_iter().map(url).collect()
        } else {
            vec![url(self.address.ip())]
        }
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
            address: _,
        } = self;
        let node = slot.node.clone();
        let component = slot.component("Operator").live_on(slot.port)?;
        let admission = Admission {
            operator: component.id(),
            authority: station.authority,
            token: station.token,
            token_to_read: station.token_to_read,
            hosts: station.hosts,
            node,
        };
        let (session, access) = Session::new(component, station.vehicle, station.authority);
        let server = Server::new(admission, access);
        tokio::select! {
            error = session.run() => Err(error),
            error = server.run(listener) => {
                Err(PartError::Broken(format!("the page can not be offered any more: {error}")))
            }
        }
    }
}

async fn listen(listen: Listen) -> Result<TcpListener, PartError> {
    let broken = |address: SocketAddr, error: std::io::Error| {
        PartError::Broken(format!(
            "the page can not be offered at {address} (--listen): {error}; choose another address \
             or port"
        ))
    };
    match listen {
        Listen::At(address) => {
            let listener = TcpListener::bind(address).await;
            listener.map_err(|error| broken(address, error))
        }
        Listen::Loopback => {
            let mut port = Listen::PORT;
            loop {
                let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
                match TcpListener::bind(address).await {
                    Ok(listener) => return Ok(listener),
                    Err(_) if port < Listen::PORT + Listen::PORTS => port += 1,
                    Err(error) => return Err(broken(address, error)),
                }
            }
        }
    }
}

/// The addresses of this machine that another one may reach, or the loopback one.
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
