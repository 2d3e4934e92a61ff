//! Test scene: a vehicle, the operator's station, and pages.

use std::net::{Ipv4Addr, SocketAddr};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, UNIX_EPOCH};

use futures_util::{SinkExt, StreamExt};
use jaus::address::JausId;
use jaus::component::{
    AccessControl, Builder, Component, Handlers, Kind, Management, Scope, TimeOfDay,
};
use jaus::link::Group;
use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::messages::mobility::{
    QueryLocalPose, QueryLocalPoseExt, QueryWrenchEffort, ReportLocalPose, SetWrenchEffort,
    local_pose_sensor, primitive_driver,
};
use jaus::node::{Config, Node};
use jaus_ocu::{Listen, Station};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{LIMIT, until, within_limit};
use jaus_vehicle::handoff::Handoff;
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};
use jaus_vehicle::parts::{Part, Slot};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// A vehicle that is one component, and a station that observes it.
pub(crate) struct Scene {
    pub(crate) vehicle: Vehicle,
    pub(crate) rover: Option<Component>,
    pub(crate) address: SocketAddr,
    group: Group,
    timeout: u8,
    frozen: Option<Arc<AtomicBool>>,
    station: JoinHandle<()>,
    nodes: Vec<Node>,
}

impl Scene {
    pub(crate) async fn new() -> Self {
        Self::with(Station::default(), 0).await
    }

    /// With a pose sensor that repeats its last sample while `switch` is set.
    pub(crate) async fn with_frozen_pose(switch: Arc<AtomicBool>) -> Self {
        Self::start(Station::default(), 0, Some(switch)).await
    }

    /// With a vehicle whose control times out after this many seconds; 0 disables the timeout.
    pub(crate) async fn with(station: Station, timeout: u8) -> Self {
        Self::start(station, timeout, None).await
    }

    async fn start(station: Station, timeout: u8, frozen: Option<Arc<AtomicBool>>) -> Self {
        let group = own_group();
        let node = Node::start(Config::loopback(101, 1).group(group)).unwrap();
        let vehicle = simulated();
        let rover = rover(&vehicle, &node, timeout, frozen.as_ref());
        let station = Station {
            listen: Listen::At((Ipv4Addr::LOCALHOST, 0).into()),
            unprotected: station.token.is_none() && station.users.is_none(),
            ..station
        };
        let (address, station, session) = start(station, 42, group).await;
        Self {
            vehicle,
            rover: Some(rover),
            address,
            group,
            timeout,
            frozen,
            station,
            nodes: vec![node, session],
        }
    }

    /// Starts another operator's station on the same network. Returns its address, and handles that
    /// keep it alive.
    pub(crate) async fn another_station(
        &self,
        authority: u8,
    ) -> (SocketAddr, JoinHandle<()>, Node) {
        let station = Station {
            authority,
            listen: Listen::At((Ipv4Addr::LOCALHOST, 0).into()),
            unprotected: true,
            ..Station::default()
        };
        start(station, 43, self.group).await
    }

    /// Starts a station on the vehicle's own node. Returns its address, and a handle that keeps it
    /// alive.
    pub(crate) async fn station_of_the_vehicle(&self) -> (SocketAddr, JoinHandle<()>) {
        let station = Station {
            vehicles: vec![101],
            listen: Listen::At((Ipv4Addr::LOCALHOST, 0).into()),
            unprotected: true,
            ..Station::default()
        };
        start_on(&self.nodes[0], 2, station).await
    }

    /// A client that is no station, and its node.
    pub(crate) fn client(&self) -> (Component, Node) {
        let node = Node::start(Config::loopback(44, 1).group(self.group)).unwrap();
        let client = Component::builder(Kind::OperatorControlUnit, "Client").attach(&node, 1);
        (client.unwrap(), node)
    }

    /// Starts another vehicle on the same network.
    pub(crate) fn another_vehicle(&self, subsystem: u16) -> OtherVehicle {
        let node = Node::start(Config::loopback(subsystem, 1).group(self.group)).unwrap();
        let vehicle = simulated();
        let rover = rover(&vehicle, &node, 0, None);
        OtherVehicle {
            vehicle,
            rover,
            node,
        }
    }

    /// Starts vehicles that obey and do not move, on a node that carries all of them.
    pub(crate) fn unmoving_vehicles(&self, subsystems: Range<u16>) -> (Node, Vec<Component>) {
        let node = Node::start(Config::loopback(subsystems.start, 2).group(self.group)).unwrap();
        let start = |subsystem| {
            let driver = Handlers::new(primitive_driver::LATEST)
                .command(|_: SetWrenchEffort, _, _| {})
                .declines::<QueryWrenchEffort>()
                .on_stop(|_| {});
            let rover = Component::builder(Kind::Vehicle, "Rover")
                .scope(Scope::Nobody)
                .management(Management::new())
                .offer(driver);
            let port = node.attach_as(JausId::new(subsystem, 1, 1)).unwrap();
            rover.live_on(port).unwrap()
        };
        let vehicles = subsystems.map(start).collect();
        (node, vehicles)
    }

    /// Sends a GET request with further header lines. Returns the head of the response in lower
    /// case, and its body.
    pub(crate) async fn get(&self, path: &str, headers: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        let request =
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n{headers}Connection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = Vec::new();
        within_limit(stream.read_to_end(&mut answer)).await.unwrap();
        let end = answer.windows(4).position(|it| it == b"\r\n\r\n").unwrap();
        let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
        (head, answer[end + 4..].to_vec())
    }

    pub(crate) async fn page(&self) -> Page {
        Page::open(self.address).await
    }

    /// The page of an operator who controls a vehicle that is Ready.
    pub(crate) async fn driver(&self) -> Page {
        let mut page = self.page().await;
        page.select(101).await;
        page.until(|state| !state["vehicle"]["pose"].is_null())
            .await;
        page.ask(json!({"type": "control", "on": true}))
            .await
            .unwrap();
        page.ask(json!({"type": "resume"})).await.unwrap();
        page
    }

    /// Ends the vehicle's component and starts a new one without its state.
    pub(crate) async fn restart_rover(&mut self) {
        self.end_rover();
        self.start_rover().await;
    }

    pub(crate) fn end_rover(&mut self) {
        drop(self.rover.take());
    }

    pub(crate) async fn start_rover(&mut self) {
        until(|| self.is_free(1)).await;
        let frozen = self.frozen.as_ref();
        self.rover = Some(rover(&self.vehicle, &self.nodes[0], self.timeout, frozen));
    }

    /// Whether a component number of the vehicle is free: the old component has detached.
    pub(crate) fn is_free(&self, component: u8) -> bool {
        let components = self.nodes[0].components();
        components.iter().all(|it| it.id.component() != component)
    }

    /// Ends this station without notice to its pages.
    pub(crate) fn end_station(&self) {
        self.station.abort();
    }

    pub(crate) fn is_controlled(&self) -> bool {
        let standing = self.rover.as_ref().map(Component::standing);
        standing.is_some_and(|it| it.controller.is_some())
    }

    /// A slot for another part of the vehicle.
    pub(crate) fn slot(&self, component: u8) -> Slot {
        let node = &self.nodes[0];
        Slot::new(
            node.attach(component).unwrap(),
            node.clone(),
            Kind::Vehicle,
            "Rover",
        )
    }

    /// Attaches another component to the vehicle's node.
    pub(crate) fn attach(&self, component: u8, builder: Builder) -> Component {
        builder.attach(&self.nodes[0], component).unwrap()
    }

    pub(crate) fn speed(&self) -> f64 {
        self.vehicle.motion().velocity.x
    }

    /// Waits until the condition on the vehicle holds.
    pub(crate) async fn until(&self, wanted: impl Fn(&Self) -> bool) {
        until(|| wanted(self)).await;
    }
}

/// A further vehicle.
pub(crate) struct OtherVehicle {
    pub(crate) vehicle: Vehicle,
    pub(crate) rover: Component,
    pub(crate) node: Node,
}

impl OtherVehicle {
    pub(crate) fn speed(&self) -> f64 {
        self.vehicle.motion().velocity.x
    }
}

fn simulated() -> Vehicle {
    let platform = SkidSteer::new(SkidSteerConfig::default());
    Vehicle::new(Pilot::new(platform, Frame::at(52.5, 13.4)))
        .with_clock(TimeOfDay::new(|| UNIX_EPOCH.elapsed().unwrap()))
}

impl Drop for Scene {
    fn drop(&mut self) {
        self.station.abort();
    }
}

/// A component with the services needed to drive it.
fn rover(
    vehicle: &Vehicle,
    node: &Node,
    timeout: u8,
    frozen: Option<&Arc<AtomicBool>>,
) -> Component {
    let control = AccessControl::new().timeout(timeout);
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .management(Management::new().access_control(control))
        .offer(Handoff::new())
        .offer(vehicle.velocity_state_sensor())
        .offer(vehicle.primitive_driver());
    let rover = match frozen {
        Some(switch) => rover.offer(pose_that_freezes(Arc::clone(switch))),
        None => rover.offer(vehicle.local_pose_sensor()),
    };
    rover.attach(node, 1).unwrap()
}

/// A pose sensor whose samples advance unless `switch` is set.
fn pose_that_freezes(switch: Arc<AtomicBool>) -> Handlers {
    let start = Instant::now();
    let mut sampled = Duration::ZERO;
    Handlers::new(local_pose_sensor::LATEST)
        .answer(move |_: QueryLocalPose| {
            if !switch.load(Ordering::Relaxed) {
                sampled = start.elapsed();
            }
            let seconds = u8::try_from(sampled.as_secs()).unwrap();
            let stamp = TimeStamp::default().with_seconds(seconds).unwrap();
            let milliseconds = u16::try_from(sampled.subsec_millis()).unwrap();
            let mut report = ReportLocalPose {
                time_stamp: stamp.with_milliseconds(milliseconds).ok(),
                ..ReportLocalPose::default()
            };
            report.set_x_m(3.0).unwrap();
            report.set_y_m(4.0).unwrap();
            report
        })
        .declines::<QueryLocalPoseExt>()
}

async fn start(
    station: Station,
    subsystem: u16,
    group: Group,
) -> (SocketAddr, JoinHandle<()>, Node) {
    let node = Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
    let (address, running) = start_on(&node, 1, station).await;
    (address, running, node)
}

/// Starts a station as a component of a node.
async fn start_on(node: &Node, number: u8, station: Station) -> (SocketAddr, JoinHandle<()>) {
    let open = station.open().await.unwrap();
    let address = open.address();
    let slot = Slot::new(
        node.attach(number).unwrap(),
        node.clone(),
        Kind::OperatorControlUnit,
        "Operator",
    );
    let running = tokio::spawn(async move {
        let Err(error) = open.run(slot).await;
        panic!("the station has ended: {error}");
    });
    (address, running)
}

pub(crate) type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// A browser's WebSocket connection.
pub(crate) struct Page {
    pub(crate) socket: Socket,
    pub(crate) hello: Value,
    last_id: u64,
    /// Number of the last state, and when it was read.
    seen: Option<(u64, Instant)>,
    /// The last state, with all that was said before it.
    state: Value,
    /// The length of the last frame in octets.
    pub(crate) length: usize,
}

impl Page {
    pub(crate) async fn open(address: SocketAddr) -> Self {
        Self::try_open(address, &[]).await.unwrap()
    }

    pub(crate) async fn try_open(
        address: SocketAddr,
        headers: &[(&'static str, &str)],
    ) -> Result<Self, Box<Error>> {
        Self::open_at(&format!("ws://{address}/ws"), headers).await
    }

    /// Opens a page again after its connection was lost, as the page of the browser does.
    pub(crate) async fn reopen(&self, address: SocketAddr, vehicle: u16) -> Self {
        let secret = self.hello["secret"].as_str().unwrap();
        self.replace(address, vehicle, secret).await
    }

    /// Opens a page that claims to be this one, with a secret.
    pub(crate) async fn replace(&self, address: SocketAddr, vehicle: u16, secret: &str) -> Self {
        let page = &self.hello["page"];
        let url = format!("ws://{address}/ws?vehicle={vehicle}&replaces={page}&secret={secret}");
        Self::open_at(&url, &[]).await.unwrap()
    }

    pub(crate) async fn open_at(
        url: &str,
        headers: &[(&'static str, &str)],
    ) -> Result<Self, Box<Error>> {
        let mut request = url.into_client_request().unwrap();
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().unwrap());
        }
        let (socket, _) = within_limit(connect_async(request)).await?;
        let mut page = Self {
            socket,
            hello: Value::Null,
            last_id: 0,
            seen: None,
            state: Value::Null,
            length: 0,
        };
        page.hello = page.next().await;
        assert_eq!(page.hello["type"], "hello");
        Ok(page)
    }

    /// The next message from the station. A state is confirmed.
    pub(crate) async fn next(&mut self) -> Value {
        let said = self.next_unconfirmed().await;
        if said["type"] == "state" {
            let seq = said["seq"].as_u64().unwrap();
            self.seen = Some((seq, Instant::now()));
            self.say(&json!([seq, 0])).await;
        }
        said
    }

    pub(crate) async fn next_unconfirmed(&mut self) -> Value {
        let text = loop {
            match within_limit(self.socket.next())
                .await
                .expect("closed")
                .unwrap()
            {
                Message::Text(text) => break text,
                Message::Ping(_) => {}
                other => panic!("{other:?}"),
            }
        };
        self.length = text.len();
        let said: Value = serde_json::from_str(&text).unwrap();
        if said["type"] != "state" {
            return said;
        }
        apply(&mut self.state, said);
        self.state.clone()
    }

    /// A setpoint by the last state that was read.
    pub(crate) fn push(&self, forward: f64) -> Value {
        let (seq, at) = self.seen.unwrap_or((0, Instant::now()));
        let held = u64::try_from(at.elapsed().as_millis()).unwrap();
        json!({"type": "drive", "forward": forward, "turn": 0.0, "seen": seq, "held_ms": held})
    }

    /// Asks to drive by a fresh state.
    pub(crate) async fn drive(&mut self, forward: f64) -> Result<(), String> {
        // One that has waited to be read may be old.
        for _ in 0..2 {
            self.state().await;
        }
        let push = self.push(forward);
        self.ask(push).await
    }

    /// Reads for this time.
    pub(crate) async fn read_for(&mut self, time: Duration) {
        let end = tokio::time::Instant::now() + time;
        while tokio::time::timeout_at(end, self.next()).await.is_ok() {}
    }

    /// The next state.
    pub(crate) async fn state(&mut self) -> Value {
        self.said("state").await
    }

    /// The next list of vehicles that satisfies the condition.
    pub(crate) async fn fleet_until(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        let frame = self.said_until("fleet", |it| wanted(&it["vehicles"]));
        frame.await["vehicles"].take()
    }

    /// The next frame of a type.
    pub(crate) async fn said(&mut self, wanted: &str) -> Value {
        loop {
            let said = self.next().await;
            if said["type"] == wanted {
                return said;
            }
        }
    }

    /// The next state that satisfies the condition.
    pub(crate) async fn until(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.said_until("state", wanted).await
    }

    /// The next frame of a type that satisfies the condition.
    pub(crate) async fn said_until(
        &mut self,
        kind: &str,
        wanted: impl Fn(&Value) -> bool,
    ) -> Value {
        let mut last = Value::Null;
        let found = tokio::time::timeout(LIMIT, async {
            loop {
                last = self.said(kind).await;
                if wanted(&last) {
                    return last.clone();
                }
            }
        });
        match found.await {
            Ok(frame) => frame,
            Err(_) => panic!("it never came to that: {last:#}"),
        }
    }

    /// Selects a vehicle as soon as it is listed.
    pub(crate) async fn select(&mut self, subsystem: u16) {
        self.fleet_until(|fleet| {
            let mut listed = fleet.as_array().unwrap().iter();
            listed.any(|it| it["subsystem"] == subsystem)
        })
        .await;
        self.ask(json!({"type": "select", "subsystem": subsystem}))
            .await
            .unwrap();
        self.until(|state| state["vehicle"]["subsystem"] == subsystem)
            .await;
    }

    /// Sends a request without waiting for its result.
    pub(crate) async fn say(&mut self, request: &Value) {
        let said = self.socket.send(Message::text(request.to_string()));
        within_limit(said).await.unwrap();
    }

    /// Sends a request, and waits for its result.
    pub(crate) async fn ask(&mut self, mut request: Value) -> Result<(), String> {
        self.last_id += 1;
        request["id"] = self.last_id.into();
        self.say(&request).await;
        loop {
            let said = self.next().await;
            if said["id"] == self.last_id {
                return match said["type"].as_str() {
                    Some("done") => Ok(()),
                    _ => Err(said["reason"].as_str().unwrap().to_owned()),
                };
            }
        }
    }

    /// Sends a drive request every 100 ms, as a page does, until the condition on the vehicle
    /// holds.
    pub(crate) async fn drive_until(&mut self, scene: &Scene, wanted: impl Fn(&Scene) -> bool) {
        within_limit(async {
            while !wanted(scene) {
                self.say(&self.push(0.5)).await;
                self.read_for(Duration::from_millis(100)).await;
            }
        })
        .await;
    }
}

/// The primitive driver in a snapshot; null if it is unknown.
pub(crate) fn driver_of(state: &Value) -> &Value {
    part_of(state, "primitive_driver")
}

/// Changes a state as a later one says.
fn apply(state: &mut Value, changes: Value) {
    match (state, changes) {
        (Value::Object(state), Value::Object(changes)) => {
            for (name, change) in changes {
                apply(state.entry(name).or_insert(Value::Null), change);
            }
        }
        (state, changes) => *state = changes,
    }
}

/// The planner in a snapshot; null if it is unknown.
pub(crate) fn planner_of(state: &Value) -> &Value {
    part_of(state, "planner")
}

fn part_of<'a>(state: &'a Value, role: &str) -> &'a Value {
    let parts = state["vehicle"]["parts"].as_array();
    let part = parts.and_then(|it| it.iter().find(|it| it["role"] == role));
    part.unwrap_or(&Value::Null)
}
