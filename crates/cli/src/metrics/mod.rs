//! The metrics of a program for Prometheus: an HTTP endpoint that serves what the node, its links,
//! its peers and its component count anyway. `docs/metrics.md` describes it.
#![expect(
    clippy::disallowed_methods,
    reason = "measures the ages of samples at the time of a scrape"
)]

mod clocks;
mod component;
mod counts;
mod exposition;
mod node;
mod server;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use clap::Args;
use jaus::component::{PeerClocks, Standing, State};
use jaus::node::Node;
use jaus_vehicle::parts::Telemetry;
use serde::Deserialize;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::time::Instant;

use self::exposition::{Exposition, Format, Unit};
use self::server::Server;
use super::failure::Failure;

// The flag `--metrics`: where the metrics are served.
#[derive(Args, Debug, Clone, Copy)]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct MetricsFlags {
    /// Serve metrics for Prometheus at http://ADDRESS:PORT/metrics; a port alone means 127.0.0.1.
    /// Anyone who reaches the address can read them [default: off]
    #[arg(long, value_name = "ADDRESS:PORT", help_heading = "Monitoring")]
    metrics: Option<MetricsAddress>,
}

/// The address of the metrics: an address with its port, or a port of 127.0.0.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct MetricsAddress(SocketAddr);

impl FromStr for MetricsAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let of_port = |port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
        let address = text.parse().or_else(|_| text.parse().map(of_port));
        address.map(Self).map_err(|_| {
            "write an address with its port, such as 127.0.0.1:9794, or a port".to_owned()
        })
    }
}

impl TryFrom<String> for MetricsAddress {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// The endpoint of a program.
pub struct Metrics {
    listener: Option<TcpListener>,
}

impl Metrics {
    /// Opens the endpoint if the flag or the settings file, `from_file`, names its address.
    ///
    /// # Errors
    /// An address that cannot be used.
    pub async fn open(
        flags: MetricsFlags,
        from_file: Option<MetricsAddress>,
    ) -> Result<Self, Failure> {
        let Some(MetricsAddress(address)) = flags.metrics.or(from_file) else {
            return Ok(Self { listener: None });
        };
        let opened = TcpListener::bind(address).await;
        let listener = opened.map_err(|error| {
            let message =
                format!("no metrics at {address}: {error}; choose another address with --metrics");
            Failure::about(&error, message)
        })?;
        let address = listener.local_addr().map_err(Failure::of)?;
        tracing::info!("metrics at http://{address}/metrics");
        if !address.ip().is_loopback() {
            tracing::info!("anyone who reaches {address} can read the metrics");
        }
        Ok(Self {
            listener: Some(listener),
        })
    }

    /// Serves the metrics of a node, if it runs in this process, and of a component. Never returns.
    pub async fn run(self, node: Option<Node>, telemetry: Telemetry) {
        let Some(listener) = self.listener else {
            return std::future::pending().await;
        };
        let emergencies = Arc::new(AtomicU64::new(0));
        let clocks = PeerClocks::default();
        let source = Source {
            node,
            telemetry: telemetry.clone(),
            emergencies: emergencies.clone(),
            clocks: clocks.clone(),
        };
        let is_loopback = listener
            .local_addr()
            .is_ok_and(|address| address.ip().is_loopback());
        let server = Server::new(Box::new(move |format| source.render(format)), is_loopback);
        tokio::select! {
            () = server.run(listener) => {}
            () = watch_component(&telemetry, &emergencies, &clocks) => {}
        }
    }
}

/// What the metrics are read from.
struct Source {
    node: Option<Node>,
    telemetry: Telemetry,
    emergencies: Arc<AtomicU64>,
    clocks: PeerClocks,
}

impl Source {
    fn render(&self, format: Format) -> String {
        let now = Instant::now().into_std();
        let mut exposition = Exposition::new(format);
        exposition
            .gauge("jaus_build_info", Unit::None, "The version of the program.")
            .add(&[("version", &env!("CARGO_PKG_VERSION"))], 1_u64);
        if let Some(node) = &self.node {
            node::add(&mut exposition, node, now);
        }
        let emergencies = self.emergencies.load(Ordering::Relaxed);
        component::add(&mut exposition, &self.telemetry.readout(), emergencies, now);
        clocks::add(&mut exposition, &self.clocks.offsets());
        exposition.finish()
    }
}

/// Counts the emergencies of the component, and measures the clocks of its peers, once it exists.
/// Never returns.
async fn watch_component(telemetry: &Telemetry, emergencies: &AtomicU64, clocks: &PeerClocks) {
    /// Interval between two looks for the component of a part that starts.
    const LOOK: Duration = Duration::from_millis(100);
    let component = loop {
        if let Some(component) = telemetry.readout().component {
            break component;
        }
        tokio::time::sleep(LOOK).await;
    };
    tokio::select! {
        () = count_emergencies(component.watch_standing(), emergencies) => {}
        never = clocks.measure(&component) => match never {},
    }
}

/// Counts how often the component enters the state emergency. Never returns.
async fn count_emergencies(mut standings: watch::Receiver<Standing>, count: &AtomicU64) {
    let mut before = State::default();
    loop {
        let state = standings.borrow_and_update().state;
        if state == State::Emergency && before != State::Emergency {
            count.fetch_add(1, Ordering::Relaxed);
        }
        before = state;
        if standings.changed().await.is_err() {
            return std::future::pending().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_one_of_this_host() {
        let address = |text: &str| {
            text.parse()
                .map(|MetricsAddress(address)| address.to_string())
        };
        assert_eq!(address("9794").unwrap(), "127.0.0.1:9794");
        assert_eq!(address("0.0.0.0:9794").unwrap(), "0.0.0.0:9794");
        assert_eq!(address("[::1]:1").unwrap(), "[::1]:1");
        for wrong in ["", "localhost", "127.0.0.1", "99999"] {
            assert!(address(wrong).unwrap_err().contains("127.0.0.1:9794"));
        }
    }

    #[tokio::test(start_paused = true)]
    async fn each_entry_into_emergency_counts_once() {
        let (tell, standings) = watch::channel(Standing::default());
        let count = AtomicU64::new(0);
        let telling = async {
            for state in [
                State::Emergency,
                State::Emergency,
                State::Standby,
                State::Emergency,
            ] {
                tell.send_modify(|standing| standing.state = state);
                tokio::task::yield_now().await;
            }
        };
        tokio::select! {
            biased;
            () = count_emergencies(standings, &count) => {}
            () = telling => {}
        }
        assert_eq!(count.load(Ordering::Relaxed), 2);
    }
}
