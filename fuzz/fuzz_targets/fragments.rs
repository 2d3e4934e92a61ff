//! Large messages in fragments, as a sequence of operations against a model: a message is delivered
//! whole and unchanged, and not more often than all of its fragments arrived.
//!
//! The first octet chooses large or small budgets. Then each step is an octet for the operation,
//! and octets for its arguments: a sender fragments another message, a fragment arrives (in any
//! order, repeatedly, or never), time passes, or a forged fragment arrives with numbers of its own.
#![no_main]

use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, LinkId, LinkProfile, Path, Received};
use jaus::wire::{Acknowledgement, DataControl, Flags, Frame, judp};
use libfuzzer_sys::fuzz_target;

/// Time zero of every input.
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

const US: JausId = JausId::new(101, 1, 1);
const SENDERS: usize = 3;
const MOST_MESSAGES: usize = 64;

/// A fragmented message.
struct Sent {
    sender: usize,
    content: Bytes,
    part: usize,
    first: u16,
    /// How often each fragment arrived.
    given: Vec<u32>,
    delivered: u32,
}

/// The model beside the endpoint.
struct World {
    endpoint: Endpoint,
    received: Vec<Received>,
    config: Config,
    now: Instant,
    sent: Vec<Sent>,
    /// The next sequence number of each sender.
    next: [u16; SENDERS],
    /// Whether nothing may be forgotten: the budgets are large, and no time has passed.
    calm: bool,
    /// Senders whose fragments were forged: nothing is guaranteed for them.
    forged: [bool; SENDERS],
}

fuzz_target!(|octets: &[u8]| {
    let Some((&budgets, mut story)) = octets.split_first() else {
        return;
    };
    let mut world = World::new(budgets & 1 == 0);
    while !story.is_empty() {
        world.step(&mut story);
        world.check();
    }
});

/// The next octet of the input; zero at its end.
fn octet(story: &mut &[u8]) -> u8 {
    let Some((&first, rest)) = story.split_first() else {
        return 0;
    };
    *story = rest;
    first
}

impl World {
    fn new(roomy: bool) -> Self {
        let narrow = Config {
            max_message: 256,
            max_reassembly_per_sender: 600,
            max_reassembly: 1000,
            ..Config::default()
        };
        let config = if roomy { Config::default() } else { narrow };
        let mut endpoint = Endpoint::new(config.clone());
        endpoint.attach(US).expect("the first component");
        endpoint.add_link(LinkId(0), LinkProfile::judp([]));
        Self {
            endpoint,
            received: Vec::new(),
            config,
            now: *START,
            sent: Vec::new(),
            next: [1, 0xFFF0, 700],
            calm: roomy,
            forged: [false; SENDERS],
        }
    }

    fn step(&mut self, story: &mut &[u8]) {
        match octet(story) % 16 {
            0..3 => self.cut(octet(story), octet(story), octet(story)),
            3 => {
                self.now += Duration::from_millis(u64::from(octet(story)) * 40);
                self.endpoint.handle_timeout(self.now);
                self.calm = false;
            }
            4 => self.forge(octet(story), octet(story), octet(story)),
            _ => self.give(octet(story), octet(story)),
        }
    }

    /// A sender splits a message into fragments.
    fn cut(&mut self, sender: u8, parts: u8, part: u8) {
        if self.sent.len() == MOST_MESSAGES {
            return;
        }
        let sender = usize::from(sender) % SENDERS;
        let (parts, part) = (2 + usize::from(parts % 7), 4 + usize::from(part % 60));
        // Every fragment of every message has different content.
        let mark = self.sent.len() as u8;
        let content = (0..parts * part - part / 2).map(|i| match i % 2 {
            0 => mark,
            _ => (i / part) as u8,
        });
        self.sent.push(Sent {
            sender,
            content: content.collect(),
            part,
            first: self.next[sender],
            given: vec![0; parts],
            delivered: 0,
        });
        self.next[sender] = self.next[sender].wrapping_add(parts as u16);
    }

    /// A fragment of a message arrives.
    fn give(&mut self, message: u8, index: u8) {
        if self.sent.is_empty() {
            return;
        }
        let message = usize::from(message) % self.sent.len();
        let sent = &mut self.sent[message];
        let index = usize::from(index) % sent.given.len();
        sent.given[index] += 1;
        let data = match index {
            0 => DataControl::First,
            _ if index + 1 == sent.given.len() => DataControl::Last,
            _ => DataControl::Middle,
        };
        let end = sent.content.len().min((index + 1) * sent.part);
        let payload = sent.content.slice(index * sent.part..end);
        let sequence = sent.first.wrapping_add(index as u16);
        let sender = sent.sender;
        self.arrive(sender, data, sequence, payload);
    }

    /// An attacker sends a fragment in a sender's name.
    fn forge(&mut self, sender: u8, flags: u8, near: u8) {
        let sender = usize::from(sender) % SENDERS;
        self.forged[sender] = true;
        let data = [DataControl::First, DataControl::Middle, DataControl::Last];
        let sequence = self.next[sender].wrapping_sub(u16::from(near % 16));
        let payload = Bytes::from(vec![0xEE; 2 + usize::from(near)]);
        self.arrive(sender, data[usize::from(flags) % 3], sequence, payload);
    }

    fn arrive(&mut self, sender: usize, data: DataControl, sequence: u16, payload: Bytes) {
        let id = JausId::new(42, 1, 1 + sender as u8);
        let flags = Flags::default()
            .with_data(data)
            .with_acknowledgement(Acknowledgement::Request);
        let frame = Frame {
            flags,
            sequence,
            ..Frame::new(id, US, payload)
        };
        let path = Path {
            link: LinkId(0),
            peer: SocketAddr::from(([10, 0, 0, 1 + sender as u8], 3794)).into(),
        };
        let datagram = judp::encode(&frame).expect("a short frame");
        self.endpoint
            .handle_datagram(self.now, path, datagram, &mut self.received);
        while self.endpoint.poll_transmit(self.now).is_some() {}
    }

    fn check(&mut self) {
        assert!(self.endpoint.unfinished() <= self.config.max_reassembly);
        while self.endpoint.poll_event().is_some() {}
        for received in self.received.drain(..) {
            let sender = usize::from(received.source.component() - 1);
            let whole =
                |sent: &&mut Sent| sent.sender == sender && sent.content == received.payload;
            match self.sent.iter_mut().find(whole) {
                Some(sent) => sent.delivered += 1,
                None => assert!(self.forged[sender], "nobody has sent this"),
            }
        }
        for sent in self.sent.iter().filter(|sent| !self.forged[sent.sender]) {
            let complete = sent.given.iter().copied().min().unwrap_or(0);
            assert!(sent.delivered <= complete, "delivered without all of it");
            assert!(
                !self.calm || complete == 0 || sent.delivered > 0,
                "all of it has arrived, and it was not delivered"
            );
        }
    }
}
