//! A scripted peer with configurable answers, right or wrong.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::{Message, Text};
use jaus::endpoint::{Outgoing, Received};
use jaus::link::Group;
use jaus::messages::core::report_identification::{QueryType, Type};
use jaus::messages::core::report_services::{
    ComponentRec, ComponentSeq, NodeRec, NodeSeq, ServiceRec,
};
use jaus::messages::core::{
    QueryHeartbeatPulse, QueryIdentification, QueryServices, ReportHeartbeatPulse,
    ReportIdentification, ReportServices,
};
use jaus::node::{Config, Node};

/// Id of the peers in these tests.
pub(crate) const PEER: JausId = JausId::new(105, 1, 1);

/// A UDP port that is free now.
pub(crate) fn free_port() -> u16 {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    socket.local_addr().unwrap().port()
}

/// Flags for a test's own network on the loopback interface; the last is the group.
pub(crate) fn network() -> Vec<String> {
    let group = format!("239.255.78.1:{}", free_port());
    ["--loopback", "--group", &group]
        .map(str::to_owned)
        .to_vec()
}

/// A peer's message and its receiver; `None` is the sender of the query.
type Answer = (Option<JausId>, Bytes);

/// Configuration of a peer.
#[derive(Default)]
pub(crate) struct Peer {
    name: Option<&'static str>,
    services: Vec<&'static str>,
    /// Whether its services have version 1.0 instead of 1.1.
    has_first_versions: bool,
    /// Answers by the code of the request, in the order of the requests; the last one is repeated.
    answers: BTreeMap<u16, Vec<Vec<Answer>>>,
    delay: Duration,
    behaviour: Option<Behaviour>,
    /// The request after which it answers nothing.
    silenced_by: Option<u16>,
    is_silent: bool,
}

/// Handles a message before the peer looks for a listed answer.
pub(crate) type Behaviour = Box<dyn FnMut(&Received) -> Option<Bytes> + Send>;

/// A peer on the network; stopped when dropped.
pub(crate) struct Running {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Peer {
    /// A peer that lists these services. By default it answers only discovery, and heartbeat
    /// queries if it offers Liveness.
    pub(crate) fn offering(services: &[&'static str]) -> Self {
        let mut peer = Self::default();
        peer.services.extend(services);
        peer.services.push(jaus::messages::core::transport::URN);
        peer.services.push(jaus::messages::core::discovery::URN);
        peer
    }

    /// Calls itself something else.
    pub(crate) fn named(mut self, name: &'static str) -> Self {
        self.name = Some(name);
        self
    }

    /// Lists its services in version 1.0, as JAUS++ does.
    pub(crate) fn in_first_versions(mut self) -> Self {
        self.has_first_versions = true;
        self
    }

    /// Adds the answer to the next request of this type.
    pub(crate) fn answers<Q: Message>(self, answer: &impl Message) -> Self {
        self.answers_octets(Q::CODE, answer.encode().unwrap())
    }

    /// Adds the answer to the next request with this code.
    pub(crate) fn answers_octets(mut self, code: u16, octets: Bytes) -> Self {
        let answers = self.answers.entry(code).or_default();
        answers.push(vec![(None, octets)]);
        self
    }

    /// Adds the answer to the next request of this type, sent to another component.
    pub(crate) fn answers_to<Q: Message>(mut self, to: JausId, answer: &impl Message) -> Self {
        let answers = self.answers.entry(Q::CODE).or_default();
        answers.push(vec![(Some(to), answer.encode().unwrap())]);
        self
    }

    /// Answers neither this request nor any after it, as a process that hangs.
    pub(crate) fn falls_silent_at<Q: Message>(mut self) -> Self {
        self.silenced_by = Some(Q::CODE);
        self
    }

    /// Delays the listed answers.
    pub(crate) fn late(mut self, delay: Duration) -> Self {
        self.delay = delay;
        self
    }

    /// Passes each message to `behaviour` first; messages that it does not answer are answered as
    /// by other peers.
    pub(crate) fn behaves(
        mut self,
        behaviour: impl FnMut(&Received) -> Option<Bytes> + Send + 'static,
    ) -> Self {
        self.behaviour = Some(Box::new(behaviour));
        self
    }

    /// Starts the peer on the loopback interface, in the group that the flags name.
    pub(crate) fn start(self, flags: &[String]) -> Running {
        let group: Group = flags.last().unwrap().parse().unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let (ready, is_ready) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build()
                .unwrap();
            runtime.block_on(self.run(group, &stopped, ready));
        });
        is_ready.recv().unwrap();
        Running {
            stop,
            thread: Some(thread),
        }
    }

    async fn run(mut self, group: Group, stop: &AtomicBool, ready: std::sync::mpsc::Sender<()>) {
        let config = Config::loopback(PEER.subsystem(), PEER.node()).group(group);
        let node = Node::start(config).unwrap();
        let mut port = node.attach(PEER.component()).unwrap();
        ready.send(()).unwrap();
        while !stop.load(Ordering::Relaxed) {
            let soon = Duration::from_millis(20);
            let Ok(Some(request)) = tokio::time::timeout(soon, port.recv()).await else {
                continue;
            };
            for (to, octets) in self.answer(&request).await {
                let to = to.unwrap_or(request.source);
                port.send(Outgoing::new(PEER, to, octets)).unwrap();
            }
        }
    }

    async fn answer(&mut self, request: &Received) -> Vec<Answer> {
        let code = u16::from_le_bytes(*request.payload.first_chunk().unwrap());
        self.is_silent |= self.silenced_by == Some(code);
        if self.is_silent {
            return Vec::new();
        }
        if let Some(octets) = self.behaviour.as_mut().and_then(|it| it(request)) {
            return vec![(None, octets)];
        }
        if let Some(answers) = self.answers.get_mut(&code) {
            tokio::time::sleep(self.delay).await;
            let last = answers.len() == 1;
            return if last {
                answers[0].clone()
            } else {
                answers.remove(0)
            };
        }
        let octets = match code {
            QueryIdentification::CODE => self.identification(&request.payload).encode(),
            QueryServices::CODE => self.services().encode(),
            QueryHeartbeatPulse::CODE
                if self.services.contains(&jaus::messages::core::liveness::URN) =>
            {
                ReportHeartbeatPulse.encode()
            }
            _ => return Vec::new(),
        };
        vec![(None, octets.unwrap())]
    }

    fn identification(&self, query: &Bytes) -> ReportIdentification {
        let query = QueryIdentification::decode(query).unwrap();
        ReportIdentification {
            query_type: QueryType(query.query_type.0),
            r#type: Type::VEHICLE,
            identification: Text::from_static(self.name.unwrap_or("Puppet")),
        }
    }

    fn services(&self) -> ReportServices {
        let service = |urn: &&'static str| ServiceRec {
            uri: Text::from_static(urn),
            major_version_number: 1,
            minor_version_number: u8::from(!self.has_first_versions),
        };
        let component = ComponentSeq {
            component_rec: ComponentRec {
                component_id: PEER.component(),
                instance_id: 0,
            },
            service_list: self.services.iter().map(service).collect(),
        };
        ReportServices {
            node_list: vec![NodeSeq {
                node_rec: NodeRec {
                    node_id: PEER.node(),
                },
                component_list: vec![component],
            }],
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
