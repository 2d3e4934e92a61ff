//! Arbitrary input to a gateway, from RA systems and from JAUS components: no panic, bounded tables
//! and output, advancing time, and no messages in the name of a JAUS component that the gateway has
//! not attached.
//!
//! The input is a sequence of steps. Each begins with an octet for the time that passes, one for
//! the side and the sender, and one for the length of the data that follows.
#![no_main]

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{LinkId, Path, Received};
use jaus::rights::Acceptance;
use jaus::wire::ra::{Fields, Header, PREFIX};
use jaus::wire::{Acknowledgement, Broadcast, Priority};
use jaus_fuzz::message;
use jaus_ra::RaId;
use jaus_ra::gateway::{Action, Gateway, Settings};
use libfuzzer_sys::fuzz_target;

/// Time zero of every input.
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

const GATEWAY: JausId = JausId::new(250, 1, 1);
/// The limit of RA components visible to JAUS here.
const COMPONENTS: usize = 8;
/// The limit of datagrams, and of actions, that a single call may produce.
const MOST_OUT: usize = 4096;

struct Story {
    gateway: Gateway,
    now: Instant,
    attached: BTreeSet<JausId>,
}

fuzz_target!(|octets: &[u8]| {
    let mut settings = Settings {
        max_components: COMPONENTS,
        ..Settings::default()
    };
    settings.ra.carrier.max_message = 16_384;
    settings.ra.max_components = 16;
    settings.ra.queue_limit = 32;
    let all = "65535.255.255 control=255 clear-emergency=any configure also=any";
    settings.grants = Acceptance::new([all.parse().expect("a grant")]);
    let mut story = Story {
        gateway: Gateway::new(GATEWAY, settings).expect("sound settings"),
        now: *START,
        attached: BTreeSet::new(),
    };
    story.gateway.start(story.now);
    story.settle();
    let mut steps = octets;
    while let Some((&[pause, how, length], rest)) = steps.split_first_chunk() {
        let (data, rest) = rest.split_at(rest.len().min(length.into()));
        steps = rest;
        story.pass(pause);
        story.step(how, data);
        story.settle();
    }
    story.gateway.take_leave(story.now);
    story.settle();
});

impl Story {
    fn step(&mut self, how: u8, data: &[u8]) {
        let from = SocketAddr::from(([10, 0, 0, how & 3], 3794));
        match how >> 4 & 7 {
            0 => {
                let datagram = Bytes::copy_from_slice(data);
                self.gateway.handle_datagram(self.now, from, datagram);
            }
            1..4 => self.gateway.handle_datagram(self.now, from, framed(data)),
            7 if how & 12 == 12 => self.gateway.release_all(self.now),
            side => {
                let to = self.attached.iter().nth(usize::from(how >> 2 & 3));
                let (Some(&to), Some(payload)) = (to, message(side == 4, data)) else {
                    return;
                };
                let received = Received {
                    source: JausId::new(40 + u16::from(how & 3), 1, 1),
                    destination: to,
                    to,
                    priority: Priority::Standard,
                    broadcast: Broadcast::None,
                    sequence: None,
                    path: Some(Path {
                        link: LinkId(0),
                        peer: from.into(),
                    }),
                    payload,
                    acknowledged: false,
                };
                self.gateway.handle_message(self.now, &received);
            }
        }
    }

    /// Advances time, by up to 13 seconds, and wakes the gateway whenever it is due.
    fn pass(&mut self, pause: u8) {
        let end = self.now + Duration::from_millis(u64::from(pause).pow(2) / 5);
        while let Some(next) = self.gateway.poll_timeout().filter(|&next| next <= end) {
            self.now = self.now.max(next);
            self.gateway.handle_timeout(self.now);
            self.settle();
            let next = self.gateway.poll_timeout();
            assert!(next.is_none_or(|next| next > self.now), "time stands still");
        }
        self.now = end;
    }

    fn settle(&mut self) {
        let (mut datagrams, mut actions) = (0, 0);
        while self.gateway.poll_transmit().is_some() {
            datagrams += 1;
        }
        while let Some(action) = self.gateway.poll_action() {
            actions += 1;
            match action {
                Action::Attach(id) => assert!(self.attached.insert(id), "{id} twice"),
                Action::Send(message) => assert!(
                    self.attached.contains(&message.source),
                    "it speaks for {}",
                    message.source
                ),
                Action::Detach(id) => assert!(self.attached.remove(&id), "{id} was not there"),
            }
        }
        assert!(datagrams <= MOST_OUT, "{datagrams} datagrams");
        assert!(actions <= MOST_OUT, "{actions} actions");
        assert!(self.attached.len() <= COMPONENTS + 1);
    }
}

/// A datagram with a valid header. Its first octets determine the content: most are from a driver
/// of subsystem 20 to the gateway.
fn framed(octets: &[u8]) -> Bytes {
    let (head, data) = octets.split_at(octets.len().min(4));
    let at = |index: usize| head.get(index).copied().unwrap_or_default();
    let parts = [35, 32, 33, 1, 45, 46, 38, 43];
    let destination = match at(3) & 3 {
        0 => RaId::new(255, 255, 1, 1),
        1 => RaId::new(250, 1, 35, 1),
        _ => RaId::new(250, 1, 32, 1),
    };
    let fields = Fields {
        priority: 6,
        acknowledgement: Acknowledgement::None,
        service_connection: at(3) & 4 != 0,
        experimental: false,
        code: u16::from_le_bytes([at(0), at(1)]),
        destination,
        source: RaId::new(
            20 + (at(2) >> 6),
            1,
            parts[usize::from(at(2) & 7)],
            1 + (at(2) >> 3 & 3),
        ),
        data_flag: 0,
        data_size: data.len(),
        sequence: u16::from(at(3) >> 3),
    };
    [&PREFIX[..], &Header::new(&fields).octets(), data]
        .concat()
        .into()
}
