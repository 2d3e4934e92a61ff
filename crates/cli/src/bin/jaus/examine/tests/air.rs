//! Simulated network between an examination and a scripted peer, in virtual time.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use jaus::wire::{Frame, judp};

use super::super::case::{Send, Settings};
use super::super::examiner::Examiner;
use super::super::seen::{Arrival, Listener, Refusal, TcpAnswer};

/// Transit time.
const WAY: Duration = Duration::from_millis(1);
/// Interval of spontaneous actions of a peer.
const BEAT: Duration = Duration::from_millis(100);

/// A scripted peer.
pub(super) trait Scripted {
    /// Handles a message, to the peer or to others.
    fn hear(&mut self, send: &Send, air: &mut Air);
    /// Called every 100 ms.
    fn beat(&mut self, _air: &mut Air) {}
}

/// An event of the examination.
#[derive(Debug)]
enum Happening {
    Arrived(Arrival),
    Refused(SocketAddr, Refusal),
    Tcp(TcpAnswer),
}

/// Messages in transit, and the time.
pub(super) struct Air {
    pub(super) now: Duration,
    next_beat: Duration,
    flying: Vec<(Duration, Happening)>,
}

impl Air {
    pub(super) fn new() -> Self {
        Self {
            now: Duration::ZERO,
            next_beat: BEAT,
            flying: Vec::new(),
        }
    }

    pub(super) fn say(&mut self, listener: Listener, from: SocketAddr, frame: &Frame) {
        self.say_octets(listener, from, judp::encode(frame).unwrap());
    }

    pub(super) fn say_octets(&mut self, listener: Listener, from: SocketAddr, datagram: Bytes) {
        let arrival = Arrival {
            listener,
            link: 0,
            from,
            datagram,
        };
        self.flying
            .push((self.now + WAY, Happening::Arrived(arrival)));
    }

    pub(super) fn refuse(&mut self, address: SocketAddr, refusal: Refusal) {
        self.flying
            .push((self.now + WAY, Happening::Refused(address, refusal)));
    }

    pub(super) fn answer_tcp(&mut self, answer: TcpAnswer) {
        self.flying.push((self.now + WAY, Happening::Tcp(answer)));
    }

    /// Advances time until the examination is done or `go_on` returns false.
    pub(super) fn run(
        &mut self,
        examiner: &mut Examiner,
        peer: &mut dyn Scripted,
        go_on: impl Fn(&Examiner) -> bool,
    ) {
        examiner.start(self.now);
        while !examiner.is_done() && go_on(examiner) {
            assert!(
                self.now < Duration::from_secs(120),
                "it does not come to its end"
            );
            self.deliver_sends(examiner, peer);
            self.step(examiner, peer);
        }
    }

    pub(super) fn deliver_sends(&mut self, examiner: &mut Examiner, peer: &mut dyn Scripted) {
        while let Some(send) = examiner.poll_send() {
            peer.hear(&send, self);
        }
    }

    /// Processes the next event.
    fn step(&mut self, examiner: &mut Examiner, peer: &mut dyn Scripted) {
        self.flying.sort_by_key(|(at, _)| *at);
        let arrival = self.flying.first().map(|(at, _)| *at);
        let timeout = examiner.poll_timeout().unwrap();
        let soonest = timeout.min(self.next_beat);
        if let Some(at) = arrival.filter(|at| *at <= soonest) {
            self.now = at;
            let (_, happening) = self.flying.remove(0);
            match happening {
                Happening::Arrived(arrival) => examiner.handle_arrival(self.now, &arrival),
                Happening::Refused(address, refusal) => {
                    examiner.handle_refusal(self.now, address, refusal);
                }
                Happening::Tcp(answer) => examiner.handle_tcp(self.now, answer),
            }
        } else if self.next_beat <= timeout {
            self.now = self.next_beat;
            self.next_beat += BEAT;
            peer.beat(self);
        } else {
            self.now = timeout;
            examiner.handle_timeout(self.now);
        }
    }
}

/// Runs a whole examination.
pub(super) fn examine(settings: Settings, peer: &mut dyn Scripted) -> Examiner {
    let mut examiner = Examiner::new(settings);
    Air::new().run(&mut examiner, peer, |_| true);
    examiner
}

/// Answers every message with garbage.
pub(super) struct Noise(pub(super) Box<dyn FnMut() -> Vec<u8>>);

impl Scripted for Noise {
    fn hear(&mut self, _: &Send, air: &mut Air) {
        for listener in [
            Listener::Unicast,
            Listener::Group,
            Listener::RaGroup,
            Listener::Probe,
        ] {
            air.say_octets(listener, ([10, 0, 0, 2], 3794).into(), (self.0)().into());
        }
    }
}
