//! The judge's five components on the network: they send, receive, and answer the usual queries.
#![expect(clippy::disallowed_methods, reason = "the judge runs in real time")]

use std::collections::BTreeSet;
use std::task::Poll;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Event, Outgoing, Received};
use jaus::messages::core::{
    QueryHeartbeatPulse, QueryIdentification, ReportHeartbeatPulse, ReportIdentification,
    report_identification::Type,
};
use jaus::messages::registry;
use jaus::node::{Config, Events, Node, Port, Tap, Tapped, Way};
use jaus::peer::Recogniser;
use jaus::wire::{Broadcast, Frame, judp};
use jaus_cli::failure::Failure;
use tokio::time::{Instant, timeout_at};

use super::recording::Recording;
use super::step::{Form, Reach, Speaker, code_of};
use super::verdict::ObservedMessage;

/// Limit of messages by which the subject is recognised.
const TAPPED: usize = 1024;

/// Name of the judge.
const NAME: &str = "jaus judge";

/// The five components, on two nodes.
pub(super) struct JudgeNodes {
    nodes: [Node; 2],
    /// Of the two nodes: others that have their ids.
    events: [Events; 2],
    /// In the order of [`Speaker::ALL`].
    ports: [Port; 5],
    subject: JausId,
    form: Form,
    /// Queries that the subject has sent to the judge.
    asked: BTreeSet<u16>,
    /// The traffic of the first node, until the subject is recognised by it.
    tap: Option<Tap>,
    recording: Option<Recording>,
}

/// A message from the subject.
#[derive(Debug)]
pub(super) struct Heard {
    pub(super) to: Speaker,
    pub(super) at: Instant,
    pub(super) octets: Bytes,
}

impl Heard {
    pub(super) fn code(&self) -> Option<u16> {
        code_of(&self.octets)
    }
}

impl JudgeNodes {
    /// Starts the judge's nodes: `id` is the main component's, `config` its node's. The other four
    /// components are on a second node, on a port of its own. `start` starts a node.
    pub(super) fn start(
        id: JausId,
        config: Config,
        start: impl Fn(Config) -> Result<Node, Failure>,
        subject: JausId,
        recording: Option<Recording>,
    ) -> Result<Self, Failure> {
        let mut other = config.clone();
        // The highest node number has no successor.
        other.node = if config.node < JausId::ANY_NODE - 1 {
            config.node + 1
        } else {
            config.node - 1
        };
        other.port = 0;
        let (main, other) = (start(config)?, start(other)?);
        let attach = |node: &Node, component| node.attach(component).map_err(Failure::of);
        let ports = [
            attach(&main, id.component())?,
            attach(&other, 1)?,
            attach(&other, 2)?,
            attach(&other, 3)?,
            attach(&other, 4)?,
        ];
        Ok(Self {
            events: [main.events(), other.events()],
            tap: Some(main.tap(TAPPED)),
            nodes: [main, other],
            ports,
            subject,
            form: Form::Unicast,
            asked: BTreeSet::new(),
            recording,
        })
    }

    /// The ids of the five components, in the order of [`Speaker::ALL`].
    pub(super) fn ids(&self) -> [JausId; 5] {
        self.ports.each_ref().map(Port::id)
    }

    /// Sets the form of all further requests.
    pub(super) const fn use_form(&mut self, form: Form) {
        self.form = form;
    }

    /// Recognises the implementation of the subject by its messages to the first node so far, which
    /// is done once.
    pub(super) fn recognise(&mut self) -> Recogniser {
        let mut recogniser = Recogniser::default();
        let Some(mut tap) = self.tap.take() else {
            return recogniser;
        };
        while let Some(tapped) = tap.try_next() {
            let Tapped::Passage(passage) = tapped else {
                continue;
            };
            if !matches!(passage.way, Way::In(_)) {
                continue;
            }
            for mut frames in passage.datagrams().into_iter().flat_map(judp::frames) {
                let read: Vec<Frame> = frames.by_ref().map_while(Result::ok).collect();
                let of_it = read.iter().filter(|frame| frame.source == self.subject);
                of_it.for_each(|frame| recogniser.handle_frame(frame, frames.remaining()));
            }
        }
        recogniser
    }

    /// Whether the subject has sent this query to the judge.
    pub(super) fn was_asked(&self, query: u16) -> bool {
        self.asked.contains(&query)
    }

    /// Sends a message to the subject, on behalf of the named step.
    pub(super) fn say(
        &mut self,
        from: Speaker,
        reach: Reach,
        octets: Bytes,
        step: &str,
    ) -> Result<ObservedMessage, Failure> {
        let port = &self.ports[from as usize];
        let (destination, broadcast) = match (self.form, reach) {
            (Form::Unicast, _) | (_, Reach::Component) => (self.subject, Broadcast::None),
            (Form::Multicast, Reach::Node) => {
                let node = JausId::ANY_COMPONENT;
                let node = JausId::new(self.subject.subsystem(), self.subject.node(), node);
                (node, Broadcast::Global)
            }
            (Form::Multicast, Reach::Everyone) => (JausId::EVERYONE, Broadcast::Global),
        };
        let mut outgoing = Outgoing::new(port.id(), destination, octets.clone());
        outgoing.broadcast = broadcast;
        let said = ObservedMessage {
            from: port.id(),
            to: destination,
            octets,
        };
        if let Some(recording) = &mut self.recording {
            let node = &self.nodes[usize::from(from != Speaker::Main)];
            recording.sent(node, &outgoing, step)?;
        }
        port.send(outgoing).map_err(Failure::of)?;
        Ok(said)
    }

    /// Waits for a message of the subject until the deadline. Its queries are answered here and not
    /// returned.
    pub(super) async fn hear(
        &mut self,
        deadline: Instant,
        step: &str,
    ) -> Result<Option<Heard>, Failure> {
        loop {
            let [main, other] = &mut self.events;
            let received = tokio::select! {
                biased;
                failure = id_taken(main) => return Err(failure),
                failure = id_taken(other) => return Err(failure),
                received = timeout_at(deadline, receive(&mut self.ports)) => received,
            };
            let Ok(received) = received else {
                return Ok(None);
            };
            let (to, received) = received?;
            if received.source != self.subject {
                self.answer(to, &received)?;
                continue;
            }
            if let Some(recording) = &mut self.recording {
                let node = &self.nodes[usize::from(to != Speaker::Main)];
                recording.received(node, &received, step)?;
            }
            if self.answer(to, &received)? {
                continue;
            }
            return Ok(Some(Heard {
                to,
                at: Instant::now(),
                octets: received.payload,
            }));
        }
    }

    /// Discards messages that arrived already: they are too late for their request.
    pub(super) async fn clear(&mut self, step: &str) -> Result<(), Failure> {
        while self.hear(Instant::now(), step).await?.is_some() {}
        Ok(())
    }

    /// Answers a query that every component may receive. Returns whether it was one.
    fn answer(&mut self, to: Speaker, received: &Received) -> Result<bool, Failure> {
        let Some(code) = code_of(&received.payload) else {
            return Ok(false);
        };
        if registry().report_of(code).is_none() {
            return Ok(false);
        }
        if received.source == self.subject {
            self.asked.insert(code);
        }
        let answer = match code {
            QueryIdentification::CODE => identification(&received.payload),
            QueryHeartbeatPulse::CODE => ReportHeartbeatPulse.encode().ok(),
            _ => None,
        };
        if let Some(answer) = answer {
            let port = &self.ports[to as usize];
            let outgoing = Outgoing::new(port.id(), received.source, answer);
            port.send(outgoing).map_err(Failure::of)?;
        }
        Ok(true)
    }

    /// Leaves the network. Returns an error if the recording is not on disk.
    pub(super) async fn end(self) -> Result<(), Failure> {
        let Self {
            nodes,
            ports,
            recording,
            ..
        } = self;
        drop(ports);
        for node in nodes {
            node.shutdown().await;
        }
        recording.map_or(Ok(()), Recording::end)
    }
}

/// The next message to any of the five components.
async fn receive(ports: &mut [Port; 5]) -> Result<(Speaker, Received), Failure> {
    let next = std::future::poll_fn(|cx| {
        for (speaker, port) in Speaker::ALL.into_iter().zip(ports.iter_mut()) {
            if let Poll::Ready(received) = port.poll_recv(cx) {
                return Poll::Ready(received.map(|received| (speaker, received)));
            }
        }
        Poll::Pending
    });
    let next = next.await;
    next.ok_or_else(|| Failure::new("the judge's node has stopped"))
}

/// Waits until another node sends with an id of the judge: answers may go there, and the subject
/// would be blamed.
async fn id_taken(events: &mut Events) -> Failure {
    loop {
        match events.recv().await {
            Some(Event::IdConflict { id, path }) => {
                return Failure::new(format!(
                    "the node at {} also has the judge's id {id}, so answers may go there: choose \
                     another subsystem with --id",
                    path.peer
                ));
            }
            Some(_) => {}
            None => std::future::pending().await,
        }
    }
}

/// The judge's identification.
fn identification(query: &Bytes) -> Option<Bytes> {
    let query = QueryIdentification::decode(query).ok()?;
    let report = ReportIdentification {
        query_type: jaus::messages::core::report_identification::QueryType(query.query_type.0),
        r#type: Type::OCU,
        identification: NAME.into(),
    };
    report.encode().ok()
}

/// Time for the nodes to learn each other's addresses at the start.
pub(super) const SETTLING: Duration = Duration::from_millis(200);
