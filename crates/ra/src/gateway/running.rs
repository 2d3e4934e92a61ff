//! Runs the gateway: the socket of the RA network, the JAUS node with the attached proxies, and one
//! task that drives the [`Gateway`].

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::future::poll_fn;
use std::net::SocketAddr;
use std::task::Poll;
use std::time::Duration;

use bytes::Bytes;
use tokio::time::{Interval, MissedTickBehavior};

use super::{Action, Gateway, Report, Settings};
use crate::RaId;
use crate::carrier::To;
use jaus::address::JausId;
use jaus::endpoint::{Event, Received};
use jaus::link::udp::{self, UdpLink};
use jaus::link::{Group, Interface, Interfaces, Ip, STANDARD_PORT, Slab};
use jaus::node::{Node, Port, Recorder, Resident, now, sleep_until};
use jaus::wire::Priority;
use jaus_vehicle::parts::{Part, PartError, Slot};

/// Configuration of a running gateway between RA systems and JAUS.
///
/// ```no_run
/// # use jaus::component::Kind;
/// # use jaus::node::{Config, Node};
/// # use jaus_ra::gateway::RaGateway;
/// # use jaus_vehicle::parts::{Part, Slot};
/// # async fn example() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::new(250, 1).port(3795))?;
/// let slot = Slot::new(node.attach(1)?, node, Kind::OtherSubsystem, "RA gateway");
/// let gateway = RaGateway { interface: Some("eth1".to_owned()), ..RaGateway::default() };
/// gateway.run(slot).await?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct RaGateway {
    /// Gateway settings.
    pub settings: Settings,
    /// Interface of the RA network, by name or address; the first one of the JAUS node by default.
    pub interface: Option<String>,
    /// Multicast group of the RA systems.
    pub group: Group,
    /// Multicast TTL.
    pub ttl: u8,
    /// Our UDP port on the RA network; RA systems send to 3794 regardless.
    pub port: u16,
    /// Interval of reports; zero for a single one at the end, `None` for no reports.
    pub reports: Option<Duration>,
    /// Receiver of the reports.
    pub reporter: fn(&Report),
    /// Takes what RA components may and may not do, for an audit log.
    pub recorder: Option<Recorder<RaId>>,
}

impl RaGateway {
    /// Default multicast group of RA systems: 224.1.0.1.
    #[must_use]
    pub fn group() -> Group {
        const GROUP: &str = "224.1.0.1:3794";
        GROUP.parse().unwrap_or_default()
    }
}

impl Default for RaGateway {
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            interface: None,
            group: Self::group(),
            ttl: 32,
            port: STANDARD_PORT,
            reports: None,
            reporter: |report| tracing::info!("{}", report.line()),
            recorder: None,
        }
    }
}

impl Part for RaGateway {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let Some(node) = slot.node else {
            return Err(PartError::Broken(
                "the gateway attaches components of many subsystems, so it runs its own node: \
                 omit --attach"
                    .to_owned(),
            ));
        };
        let broken = |error: &dyn std::fmt::Display| PartError::Broken(error.to_string());
        let link = self.open(&node)?;
        let mut settings = self.settings;
        settings.name = slot.name;
        let gateway = Gateway::new(slot.port.id(), settings).map_err(|error| broken(&error))?;
        let (id, ra) = (gateway.id(), gateway.ra_id());
        tracing::info!("{id} is {ra} to RA systems, UDP {}", link.local());
        let resident = slot.port.reside();
        let mut running = Leaver(Some(Running {
            gateway,
            link,
            slab: Slab::default(),
            _resident: slot.port.reside(),
            ports: BTreeMap::from([(id, slot.port)]),
            node,
            reports: self.reports,
            reporter: self.reporter,
            recorder: self.recorder,
        }));
        let Some(running) = &mut running.0 else {
            return Err(PartError::NodeStopped);
        };
        tokio::select! {
            ended = running.go() => ended,
            () = resident.closing() => Err(PartError::NodeStopped),
        }
    }
}

impl RaGateway {
    fn open(&self, node: &Node) -> Result<UdpLink, PartError> {
        let broken = |error: jaus::link::Error| PartError::Broken(error.to_string());
        let interface = match &self.interface {
            Some(name) => {
                let named = Interfaces::Only(vec![name.clone()]);
                let found = named.choose(Ip::V4).map_err(broken)?;
                found.into_iter().next()
            }
            None => first_interface(node),
        };
        let interface = interface.ok_or_else(|| {
            PartError::Broken(
                "no interface for the RA network: name one with --ra-interface".to_owned(),
            )
        })?;
        let settings = udp::Settings {
            port: self.port,
            group: self.group,
            ttl: self.ttl,
            ..udp::Settings::default()
        };
        UdpLink::open(&interface, &settings).map_err(broken)
    }
}

/// The first interface of the node with an IPv4 address, as RA needs one.
fn first_interface(node: &Node) -> Option<Interface> {
    let mut interfaces = node.links().into_iter().map(|link| link.interface);
    interfaces.find(|it| it.address.is_ipv4())
}

/// Shuts the gateway down in order when it is dropped.
struct Leaver(Option<Running>);

impl Drop for Leaver {
    /// Runs at program exit, too: the node waits for its residents.
    fn drop(&mut self) {
        let runtime = tokio::runtime::Handle::try_current();
        if let (Some(running), Ok(runtime)) = (self.0.take(), runtime) {
            runtime.spawn(running.leave());
        }
    }
}

/// A gateway with its sockets and timers.
struct Running {
    gateway: Gateway,
    link: UdpLink,
    slab: Slab,
    /// Makes a stopping node wait until control is released.
    _resident: Resident,
    /// Ports of the gateway's own component and of all proxies.
    ports: BTreeMap<JausId, Port>,
    node: Node,
    reports: Option<Duration>,
    reporter: fn(&Report),
    recorder: Option<Recorder<RaId>>,
}

/// A received datagram or message.
enum Arrival {
    Datagram(SocketAddr, Bytes),
    Message(Received),
    NodeStopped,
}

impl Running {
    async fn go(&mut self) -> Result<Infallible, PartError> {
        self.gateway.start(now());
        let mut ticks = self.reports.filter(|it| !it.is_zero()).map(ticks);
        let mut events = self.node.events();
        loop {
            self.carry_out();
            let wake = self.gateway.poll_timeout();
            tokio::select! {
                arrival = poll_fn(|cx| self.poll_arrival(cx)) => match arrival {
                    Arrival::Datagram(from, datagram) => {
                        self.gateway.handle_datagram(now(), from, datagram);
                    }
                    Arrival::Message(message) => self.gateway.handle_message(now(), &message),
                    Arrival::NodeStopped => return Err(PartError::NodeStopped),
                },
                Some(event) = events.recv() => if let Event::IdConflict { id, path } = event {
                    self.gateway.handle_conflict(now(), id, path.peer);
                },
                () = sleep_until(wake) => self.gateway.handle_timeout(now()),
                () = tick(&mut ticks) => (self.reporter)(&self.gateway.report()),
            }
        }
    }

    /// Maximum time for the release of control at shutdown.
    const LEAVE: Duration = Duration::from_millis(900);

    /// Stops and releases everything under control, until confirmed or [`LEAVE`](Self::LEAVE) has
    /// passed.
    async fn leave(mut self) {
        if self.reports.is_some() {
            (self.reporter)(&self.gateway.report());
        }
        let end = now() + Self::LEAVE;
        self.gateway.release_all(now());
        self.carry_out();
        while !self.gateway.is_released() && now() < end {
            let wake = self
                .gateway
                .poll_timeout()
                .map_or(end, |wake| wake.min(end));
            tokio::select! {
                arrival = poll_fn(|cx| self.poll_arrival(cx)) => match arrival {
                    Arrival::Datagram(from, datagram) => {
                        self.gateway.handle_datagram(now(), from, datagram);
                    }
                    Arrival::Message(message) => self.gateway.handle_message(now(), &message),
                    Arrival::NodeStopped => return,
                },
                () = sleep_until(Some(wake)) => self.gateway.handle_timeout(now()),
            }
            self.carry_out();
        }
        self.gateway.take_leave(now());
        self.carry_out();
    }

    /// Waits for the next datagram or message; sends queued datagrams meanwhile.
    fn poll_arrival(&mut self, cx: &mut std::task::Context<'_>) -> Poll<Arrival> {
        // The next poll sends what is left.
        let _ = self.link.poll_flush(cx);
        if let Some(recorder) = &self.recorder {
            self.gateway.refuse_commands(recorder.refuses_commands());
        }
        if let Poll::Ready((from, datagram)) = self.link.poll_recv(cx, &mut self.slab) {
            return Poll::Ready(Arrival::Datagram(from, datagram));
        }
        for port in self.ports.values_mut() {
            match port.poll_recv(cx) {
                Poll::Ready(Some(message)) => return Poll::Ready(Arrival::Message(message)),
                Poll::Ready(None) => return Poll::Ready(Arrival::NodeStopped),
                Poll::Pending => {}
            }
        }
        Poll::Pending
    }

    fn carry_out(&mut self) {
        let decisions = std::iter::from_fn(|| self.gateway.poll_decision());
        match &mut self.recorder {
            Some(recorder) => recorder.record_all(decisions),
            None => decisions.for_each(drop),
        }
        while let Some(transmit) = self.gateway.poll_transmit() {
            let (link, datagram) = (&mut self.link, &transmit.datagram);
            match transmit.to {
                To::Group => link.send_to_group(Priority::Standard, datagram),
                To::Address(peer) => link.send_to(peer, Priority::Standard, datagram),
            }
        }
        while let Some(action) = self.gateway.poll_action() {
            match action {
                Action::Attach(id) => self.attach(id),
                Action::Detach(id) => drop(self.ports.remove(&id)),
                Action::Send(message) => {
                    let destination = message.destination;
                    let port = self.ports.get(&message.source);
                    if let Some(Err(error)) = port.map(|port| port.send(message)) {
                        tracing::debug!(%destination, %error, "not sent");
                    }
                }
            }
        }
    }

    fn attach(&mut self, id: JausId) {
        if self.ports.contains_key(&id) {
            return;
        }
        match self.node.attach_as(id) {
            Ok(port) => drop(self.ports.insert(id, port)),
            Err(error) => tracing::warn!(%error, "cannot expose an RA component"),
        }
    }
}

fn ticks(period: Duration) -> Interval {
    let mut ticks = tokio::time::interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks.reset();
    ticks
}

async fn tick(ticks: &mut Option<Interval>) {
    match ticks {
        Some(ticks) => drop(ticks.tick().await),
        None => std::future::pending().await,
    }
}
