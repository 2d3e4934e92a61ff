//! A vehicle with a session over loopback sockets, and a flood that reaches it.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::node::{Config, Node, Port};
use jaus_secure::transport::Counter;
use jaus_secure::{Key, SecureLink, Settings, Trust, TrustFile};
use tokio::runtime::Runtime;
use tokio::time::timeout;

use crate::any_port;
use crate::packets::{first_packets, key};
use crate::report::micros;

const VEHICLE: JausId = JausId::new(101, 1, 1);
const OBSERVER: JausId = JausId::new(61, 1, 1);
/// An experimental message, which no service handles.
const MESSAGE: [u8; 3] = [0x01, 0xD7, 0];

/// A vehicle that echoes messages in a thread of its own, and an observer that has a session with it.
pub(crate) struct Scene {
    pub(crate) vehicle: SocketAddr,
    vehicle_key: Key,
    operator_key: Key,
    runtime: Runtime,
    observer: Node,
    port: tokio::sync::Mutex<Port>,
}

impl Scene {
    pub(crate) fn start() -> Self {
        let [vehicle_key, operator_key, observer_key] = [key(), key(), key()];
        let lines = format!(
            "operator {} 60.255.255 command\nobserver {} 61.255.255 command\n",
            operator_key.public(),
            observer_key.public()
        );
        let trust = TrustFile::of(Trust::parse(&lines).expect("trusted keys"));
        let (key, (tell, told)) = (vehicle_key.clone(), std::sync::mpsc::channel());
        thread::spawn(move || {
            runtime().block_on(async {
                let link = SecureLink::open(&key, trust, Settings::new(any_port()));
                let link = link.expect("a free port");
                tell.send(link.local().expect("its address"))
                    .expect("a listener");
                let (_node, mut port) = node(VEHICLE, link);
                while let Some(message) = port.recv().await {
                    let echo = Outgoing::new(VEHICLE, message.source, message.payload);
                    port.send(echo).expect("sent");
                }
            });
        });
        let vehicle = told.recv().expect("the address of the vehicle");
        let runtime = runtime();
        let (observer, port) = runtime.block_on(async {
            let settings = Settings::new(any_port()).connect(vehicle);
            let link = SecureLink::open(&observer_key, trusting(&vehicle_key), settings);
            node(OBSERVER, link.expect("a free port"))
        });
        let scene = Self {
            vehicle,
            vehicle_key,
            operator_key,
            runtime,
            observer,
            port: port.into(),
        };
        scene.round_trips(10);
        scene
    }

    /// Times of round trips over the observer's session, in µs. A lost message takes a second.
    pub(crate) fn round_trips(&self, count: usize) -> Vec<f64> {
        self.runtime.block_on(async {
            let mut port = self.port.lock().await;
            let mut times = Vec::new();
            for number in 0..count {
                let start = Instant::now();
                let payload = Bytes::from([&MESSAGE[..], &number.to_le_bytes()].concat());
                loop {
                    let message = Outgoing::new(OBSERVER, VEHICLE, payload.clone());
                    port.send(message).expect("sent");
                    match timeout(Duration::from_secs(1), port.recv()).await {
                        Ok(Some(echo)) if echo.payload == payload => break,
                        _ => {}
                    }
                }
                times.push(micros(start.elapsed()));
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
            times
        })
    }

    /// A count of the observer's link.
    pub(crate) fn established(&self, counter: Counter) -> u64 {
        let name = format!("{counter:?}");
        let reports = self.observer.custom_links();
        let mut counts = reports.iter().flat_map(|it| &it.counters);
        counts.find(|it| it.name == name).expect("a counter").value
    }

    /// Dials the vehicle with a fresh link; returns whether it was up within this time.
    pub(crate) fn dial(&self, limit: Duration) -> bool {
        self.runtime.block_on(async {
            let settings = Settings::new(any_port()).connect(self.vehicle);
            let trust = trusting(&self.vehicle_key);
            let link = SecureLink::open(&self.operator_key, trust, settings);
            let mut link = link.expect("a free port");
            link.probe(&[self.vehicle], limit).await[0].is_ok()
        })
    }
}

fn trusting(vehicle: &Key) -> TrustFile {
    let line = format!("rover {} 101.255.255 command", vehicle.public());
    TrustFile::of(Trust::parse(&line).expect("a trusted key"))
}

fn node(id: JausId, link: SecureLink) -> (Node, Port) {
    let config = Config::new(id.subsystem(), id.node()).without_udp();
    let node = Node::start_with(config, vec![Box::new(link)]).expect("a node");
    let port = node.attach(id.component()).expect("a free number");
    (node, port)
}

fn runtime() -> Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}

/// First packets at a steady rate.
pub(crate) struct Flood {
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<f64>,
}

impl Flood {
    pub(crate) fn start(vehicle: SocketAddr, rate: u32) -> Self {
        let packets = first_packets(256);
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let thread = thread::spawn(move || flood(vehicle, rate, &packets, &over));
        Self { is_over, thread }
    }

    /// Ends the flood; returns its packets per second.
    pub(crate) fn stop(self) -> u64 {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.join().expect("a flood") as u64
    }
}

fn flood(vehicle: SocketAddr, rate: u32, packets: &[Bytes], is_over: &AtomicBool) -> f64 {
    let socket = UdpSocket::bind(any_port()).expect("a free port");
    let (start, mut sent) = (Instant::now(), 0_usize);
    while !is_over.load(Ordering::Relaxed) {
        let due = start.elapsed().as_secs_f64() * f64::from(rate);
        while (sent as f64) < due && !is_over.load(Ordering::Relaxed) {
            // A full queue of the kernel drops it.
            let _ = socket.send_to(&packets[sent % packets.len()], vehicle);
            sent += 1;
        }
        thread::sleep(Duration::from_micros(500));
    }
    sent as f64 / start.elapsed().as_secs_f64()
}
