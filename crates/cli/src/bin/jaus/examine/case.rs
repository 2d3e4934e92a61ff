//! State of a peer during its examination, and the queries to it.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{QueryIdentification, query_identification::QueryType};
use jaus::wire::{Acknowledgement, Broadcast, Flags, Frame, Priority, Version};

use super::exchange::{Exchange, Mark, Trial, Verdict};
use super::seen::{Heard, Reserved, Seen};
use super::target::Target;
use super::transfer::Transfer;

/// The query that every node answers: the identification of its subsystem.
pub(super) fn query_identification() -> QueryIdentification {
    QueryIdentification {
        query_type: QueryType::SUBSYSTEM_IDENTIFICATION,
    }
}

/// Code of messages without effect: user-defined (AS5710 leaves D000h and above to users).
pub(super) const PADDING: u16 = 0xD7F0;

/// Parameters of an examination.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) target: Target,
    /// Our own id.
    pub(super) own: JausId,
    /// The sequence number before our first. A peer may take a node that begins with 1 for Junior.
    pub(super) last_number: u16,
    /// The intended id of our node, if one is chosen.
    pub(super) wanted: Option<JausId>,
    /// Whether it is over a secure link, which has no ports and no multicast.
    pub(super) is_secure: bool,
    /// Our port.
    pub(super) port: u16,
    /// Why there is no multicast group, if so.
    pub(super) no_group: Option<String>,
    /// Timeout of the first sign of life.
    pub(super) listen: Duration,
    /// Whether the examination may take control.
    pub(super) control: bool,
    /// Maximum octets of payload per packet.
    pub(super) payload_limit: usize,
}

/// A network action.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Send {
    /// A message to one address, on its interface.
    To(SocketAddr, Frame),
    /// A message to the multicast group, on the peer's interface or on all.
    Group(Frame),
    /// A message from a temporary socket that detects a refused port.
    Probe(SocketAddr, Frame),
    /// A TCP connection, closed as soon as it is open.
    Connect(SocketAddr),
}

/// A query with its timing.
#[derive(Clone, Debug)]
pub(super) struct Question {
    pub(super) sends: Vec<Send>,
    /// Interval of repetitions without an answer.
    pub(super) again: Option<Duration>,
    /// Timeout of the answer.
    pub(super) patience: Duration,
}

impl Question {
    /// A query, repeated up to three times within a second.
    pub(super) fn new(send: Send) -> Self {
        Self {
            sends: vec![send],
            again: Some(Duration::from_millis(350)),
            patience: Duration::from_secs(1),
        }
    }

    /// No query; only received messages are evaluated.
    pub(super) const fn silence(patience: Duration) -> Self {
        Self {
            sends: Vec::new(),
            again: None,
            patience,
        }
    }

    /// Sends it only once: a repetition would have its own effect.
    pub(super) const fn once(mut self) -> Self {
        self.again = None;
        self
    }

    pub(super) const fn patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }
}

/// A service from the component's list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Offer {
    pub(super) urn: String,
    pub(super) major: u8,
    pub(super) minor: u8,
}

/// An event at the peer that is not cancelled yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OpenEvent {
    pub(super) id: u8,
}

/// The peer, as far as known.
#[derive(Debug)]
pub(super) struct Case {
    pub(super) settings: Settings,
    /// Its address.
    pub(super) address: Option<SocketAddr>,
    /// The examined component.
    pub(super) id: Option<JausId>,
    /// The interface that leads to it.
    pub(super) link: Option<usize>,
    pub(super) seen: Seen,
    pub(super) trials: Vec<Trial>,
    /// The services of the component, once reported.
    pub(super) services: Option<Vec<Offer>>,
    /// Number of services in the first report of a list.
    pub(super) listed: usize,
    /// Name of the component.
    pub(super) name: Option<String>,
    /// Events to cancel before the end.
    pub(super) open_events: Vec<OpenEvent>,
    pub(super) in_control: bool,
    /// A large message in transfer to the peer.
    pub(super) transfer: Option<Transfer>,
    /// Its reaction to reserved values.
    pub(super) reserved: Reserved,
    /// Whether a program there echoes messages without effect.
    pub(super) echoes: bool,
    /// Whether it has not answered in time, so that the cause is searched for.
    pub(super) is_silent: bool,
    /// Whether it was queried by multicast.
    pub(super) multicast_asked: bool,
    pub(super) unsent: VecDeque<Send>,
    sequence: u16,
}

impl Case {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            address: settings.target.address(),
            id: settings.target.id,
            sequence: settings.last_number,
            settings,
            link: None,
            seen: Seen::default(),
            trials: Vec::new(),
            services: None,
            listed: 0,
            name: None,
            open_events: Vec::new(),
            in_control: false,
            transfer: None,
            reserved: Reserved::default(),
            echoes: false,
            is_silent: false,
            multicast_asked: false,
            unsent: VecDeque::new(),
        }
    }

    /// The id for port probes: a neighbour of ours, so that no peer learns a wrong address for our
    /// id.
    pub(super) fn probe_id(&self) -> JausId {
        let own = self.settings.own;
        let next = own.component() % (JausId::ANY_COMPONENT - 1) + 1;
        JausId::new(own.subsystem(), own.node(), next)
    }

    pub(super) fn next_sequence(&mut self) -> u16 {
        self.sequence = self.sequence.wrapping_add(1);
        self.sequence
    }

    /// A message to a destination.
    pub(super) fn frame(&mut self, destination: JausId, payload: Bytes) -> Frame {
        let sequence = self.next_sequence();
        Frame {
            flags: Flags::new(Priority::Standard),
            sequence,
            ..Frame::new(self.settings.own, destination, payload)
        }
    }

    /// A message to the peer's component only.
    pub(super) fn ask_peer(&mut self, message: &impl Message) -> Option<Send> {
        let (id, address) = (self.id?, self.address?);
        Some(Send::To(address, self.frame(id, octets(message))))
    }

    /// A multicast to all components.
    pub(super) fn ask_everybody(&mut self, message: &impl Message) -> Send {
        Send::Group(self.global(JausId::EVERYONE, message))
    }

    /// A message to all components, sent to one address.
    pub(super) fn ask_all_at(&mut self, address: SocketAddr, message: &impl Message) -> Send {
        Send::To(address, self.global(JausId::EVERYONE, message))
    }

    pub(super) fn global(&mut self, destination: JausId, message: &impl Message) -> Frame {
        let mut frame = self.frame(destination, octets(message));
        frame.flags = frame.flags.with_broadcast(Broadcast::Global);
        frame
    }

    /// A short message without effect that requests an acknowledgement from the component with this
    /// id.
    pub(super) fn wanting_acknowledgement(&mut self, id: JausId) -> Frame {
        let mut frame = self.frame(id, PADDING.to_le_bytes().to_vec().into());
        frame.flags = frame.flags.with_acknowledgement(Acknowledgement::Request);
        frame
    }

    /// The same as a multicast, as Junior sends it to unknown addresses: peers without Discovery
    /// acknowledge it.
    pub(super) fn call_alone(&mut self) -> Option<Send> {
        let mut frame = self.wanting_acknowledgement(self.id?);
        frame.flags = frame.flags.with_broadcast(Broadcast::Global);
        Some(Send::Group(frame))
    }

    /// The same messages with new sequence numbers: receivers treat a repeated number as a
    /// duplicate.
    pub(super) fn anew(&mut self, sends: &[Send]) -> Vec<Send> {
        let mut sends = sends.to_vec();
        for send in &mut sends {
            if let Send::To(_, frame) | Send::Group(frame) | Send::Probe(_, frame) = send {
                frame.sequence = self.next_sequence();
            }
        }
        sends
    }

    /// The acknowledgement that a message requests.
    pub(super) fn acknowledge(&mut self, heard: &Heard) -> Option<Send> {
        let wanted = heard.frame.flags.acknowledgement() == Acknowledgement::Request;
        let for_us = heard.frame.destination == self.settings.own;
        if !wanted || !for_us || heard.frame.version != Version::As5669a {
            return None;
        }
        let flags = Flags::new(heard.frame.flags.priority());
        let frame = Frame {
            flags: flags.with_acknowledgement(Acknowledgement::Positive),
            sequence: heard.frame.sequence,
            ..Frame::new(self.settings.own, heard.frame.source, Bytes::new())
        };
        Some(Send::To(heard.from, frame))
    }

    /// Messages from the peer's component to us since a mark.
    pub(super) fn received(&self, mark: usize) -> impl DoubleEndedIterator<Item = &Heard> {
        let (own, id) = (self.settings.own, self.id);
        self.seen.since(mark).iter().filter(move |heard| {
            heard.frame.destination == own
                && Some(heard.frame.source) == id
                && heard.frame.version == Version::As5669a
        })
    }

    /// The first report of a kind from the peer's component since a mark.
    pub(super) fn report<M: Message>(&self, mark: usize) -> Option<M> {
        let mut all = self.reports(mark);
        all.next()
    }

    /// All decodable reports of a kind.
    pub(super) fn reports<M: Message>(&self, mark: usize) -> impl Iterator<Item = M> {
        let of_kind = self
            .received(mark)
            .filter(|heard| heard.code() == Some(M::CODE));
        of_kind.filter_map(|heard| M::decode(&heard.frame.payload).ok())
    }

    /// The error of the first malformed report of a kind.
    pub(super) fn unreadable<M: Message>(&self, mark: usize) -> Option<String> {
        let mut of_kind = self
            .received(mark)
            .filter(|heard| heard.code() == Some(M::CODE));
        of_kind
            .find_map(|heard| M::decode(&heard.frame.payload).err())
            .map(|error| error.to_string())
    }

    /// The result of an earlier exchange.
    pub(super) fn mark_of(&self, exchange: Exchange) -> Option<Mark> {
        let mut trials = self.trials.iter();
        let trial = trials.find(|trial| trial.exchange == exchange)?;
        Some(trial.verdict.mark)
    }

    pub(super) fn went_well(&self, exchange: Exchange) -> bool {
        self.mark_of(exchange) == Some(Mark::Ok)
    }

    /// The reason to skip everything: a basic exchange has failed.
    pub(super) fn cut_off(&self) -> Option<Verdict> {
        let mut basic = self
            .trials
            .iter()
            .filter(|t| t.exchange.is_basic() && t.failed());
        let failed = basic.next()?.exchange.name();
        Some(Verdict::cut_off(format!("needs \"{failed}\" to pass")))
    }

    /// The reason to skip queries: a basic exchange has failed, or the id is unknown.
    pub(super) fn nobody(&self) -> Option<Verdict> {
        if let Some(skip) = self.cut_off() {
            return Some(skip);
        }
        let known = self.id.is_some() && self.address.is_some();
        (!known).then(|| {
            Verdict::skipped("no component id is known at that address")
                .advice("give id and address: jaus examine 77.1.1@10.0.0.2")
        })
    }

    /// The reason to skip queries to services: none was answered so far.
    pub(super) fn mute(&self) -> Option<Verdict> {
        const BEFORE: [Exchange; 3] = [
            Exchange::Identification,
            Exchange::Heartbeat,
            Exchange::Configuration,
        ];
        let silent = |exchange| self.mark_of(exchange) == Some(Mark::Failed);
        BEFORE
            .into_iter()
            .all(silent)
            .then(|| Verdict::skipped("it answers no queries: it has no services"))
    }

    /// The reason to skip a service: the component's list does not have it.
    pub(super) fn lacks(&self, service: &str) -> Option<Verdict> {
        let listed = self.services.as_ref()?;
        let has = listed
            .iter()
            .any(|offer| offer.urn.ends_with(&format!(":{service}")));
        (!has).then(|| Verdict::skipped(format!("it lists no service {service}")))
    }
}

/// A message's octets.
pub(super) fn octets(message: &impl Message) -> Bytes {
    // No query here exceeds the limits of its definition.
    message.encode().unwrap_or_default()
}
