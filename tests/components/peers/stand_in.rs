//! A node of ours in place of a captured party, in virtual time: its endpoint, its components, and
//! all messages that it sends.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{
    Config, Endpoint, Event, LinkId, LinkProfile, Outgoing, Path, Received, Remote, To, Transmit,
};
use jaus::service::Stack;
use jaus::wire::jtcp::Decoder;
use jaus::wire::{Frame, Framing, judp};

use super::challenged::acknowledgement;

const UDP: LinkId = LinkId(0);
const TCP: LinkId = LinkId(1);

/// Our node.
pub(crate) struct StandIn {
    pub(crate) endpoint: Endpoint,
    inbox: Vec<Received>,
    stacks: BTreeMap<JausId, Stack>,
    /// All sent messages and fragments.
    pub(crate) said: Vec<Said>,
    /// Received messages for components without a stack.
    pub(crate) heard: Vec<Received>,
    /// The endpoint's other events.
    pub(crate) news: Vec<Event>,
    start: Instant,
    now: Instant,
}

/// A sent message or fragment.
#[derive(Debug, Clone)]
pub(crate) struct Said {
    /// Since the start.
    pub(crate) at: Duration,
    pub(crate) by_udp: bool,
    pub(crate) to: To,
    pub(crate) frame: Frame,
    pub(crate) datagram: Bytes,
}

impl Said {
    pub(crate) fn code(&self) -> u16 {
        self.frame.code().unwrap_or_default()
    }

    pub(crate) fn is_to(&self, address: SocketAddr) -> bool {
        self.to == To::Peer(Remote::from(address))
    }
}

impl StandIn {
    /// A node with this address.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(crate) fn new(address: SocketAddr, config: Config) -> Self {
        let mut endpoint = Endpoint::new(config);
        endpoint.add_link(UDP, LinkProfile::judp([address]));
        let now = Instant::now();
        Self {
            endpoint,
            inbox: Vec::new(),
            stacks: BTreeMap::new(),
            said: Vec::new(),
            heard: Vec::new(),
            news: Vec::new(),
            start: now,
            now,
        }
    }

    /// Adds a component to this node.
    pub(crate) fn stand_in(&mut self, mut stack: Stack) {
        self.endpoint.attach(stack.id()).expect("an id");
        stack.start(self.now);
        self.stacks.insert(stack.id(), stack);
        self.pump();
    }

    pub(crate) fn stack(&mut self, id: JausId) -> &mut Stack {
        self.stacks.get_mut(&id).expect("a component of ours")
    }

    /// The time since the start.
    pub(crate) fn at(&self) -> Duration {
        self.now - self.start
    }

    /// Advances time to `at`; never goes back.
    pub(crate) fn run_until(&mut self, at: Duration) {
        let end = self.now.max(self.start + at);
        while let Some(next) = self.next().filter(|next| *next <= end) {
            self.now = next.max(self.now);
            self.endpoint.handle_timeout(self.now);
            for stack in self.stacks.values_mut() {
                stack.handle_timeout(self.now);
            }
            self.pump();
        }
        self.now = end;
    }

    fn next(&self) -> Option<Instant> {
        let stacks = self.stacks.values().filter_map(Stack::poll_timeout);
        stacks.chain(self.endpoint.poll_timeout()).min()
    }

    /// Receives a datagram.
    pub(crate) fn hear(&mut self, from: SocketAddr, payload: Bytes) {
        let path = Path {
            link: UDP,
            peer: from.into(),
        };
        self.endpoint
            .handle_datagram(self.now, path, payload, &mut self.inbox);
        self.pump();
    }

    /// Also accepts TCP connections.
    pub(crate) fn listen(&mut self) {
        let profile = LinkProfile {
            framing: Framing::Jtcp,
            ..LinkProfile::default()
        };
        self.endpoint.add_link(TCP, profile);
    }

    /// Receives a message on the TCP connection with this remote address.
    pub(crate) fn hear_frame(&mut self, from: SocketAddr, frame: &Frame) {
        let path = Path {
            link: TCP,
            peer: from.into(),
        };
        self.endpoint
            .handle_frame(self.now, path, frame, &mut self.inbox);
        self.pump();
    }

    /// Sends a message from a component without a stack.
    pub(crate) fn say(&mut self, message: Outgoing) {
        let sent = self.endpoint.send(self.now, message, &mut self.inbox);
        sent.expect("to be sent");
        self.pump();
    }

    /// Passes messages between components and endpoint, answers challenges, and records all other
    /// transmits.
    fn pump(&mut self) {
        loop {
            self.news
                .extend(std::iter::from_fn(|| self.endpoint.poll_event()));
            for message in std::mem::take(&mut self.inbox) {
                match self.stacks.get_mut(&message.to) {
                    Some(stack) => stack.handle_message(self.now, &message),
                    None => self.heard.push(message),
                }
            }
            let mut quiet = true;
            for stack in self.stacks.values_mut() {
                while stack.poll_event().is_some() {}
                while let Some(message) = stack.poll_transmit() {
                    quiet = false;
                    let sent = self.endpoint.send(self.now, message, &mut self.inbox);
                    sent.expect("to be sent");
                }
            }
            if quiet {
                break;
            }
        }
        while let Some(transmit) = self.endpoint.poll_transmit(self.now) {
            let challenged = (transmit.link == UDP).then(|| acknowledgement(&transmit));
            match challenged.flatten() {
                Some((path, answer)) => {
                    self.endpoint
                        .handle_datagram(self.now, path, answer, &mut self.inbox);
                }
                None => self.note(&transmit),
            }
        }
    }

    fn note(&mut self, transmit: &Transmit) {
        let frames: Vec<_> = if transmit.link == UDP {
            let frames = judp::frames(transmit.payload.clone()).expect("a datagram of ours");
            frames.map_while(Result::ok).collect()
        } else {
            let mut decoder = Decoder::new();
            decoder.input().extend_from_slice(&transmit.payload);
            std::iter::from_fn(|| decoder.next_frame().expect("a message of ours")).collect()
        };
        for frame in frames {
            self.said.push(Said {
                at: self.at(),
                by_udp: transmit.link == UDP,
                to: transmit.to,
                frame,
                datagram: transmit.payload.clone(),
            });
        }
    }
}
