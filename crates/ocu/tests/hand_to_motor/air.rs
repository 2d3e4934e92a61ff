//! The JAUS network between the hosts: it delays datagrams, loses and repeats them, and brings some
//! long after those that were sent later.

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::endpoint::{Remote, SessionId, To, Transmit};
use jaus::link::custom::{Arrival, CustomLink};
use jaus_test_kit::random::Random;

/// Quality of the network.
#[derive(Clone, Debug)]
pub(crate) struct Weather {
    pub(crate) latency: Range<Duration>,
    /// Lost copies per 1000.
    pub(crate) lost: u32,
    /// Datagrams per 1000 that arrive twice.
    pub(crate) repeated: u32,
    /// Copies per 1000 that make a detour, so that later ones overtake them.
    pub(crate) detoured: u32,
    pub(crate) detour: Duration,
}

impl Weather {
    pub(crate) const fn good() -> Self {
        Self {
            latency: Duration::from_millis(1)..Duration::from_millis(3),
            lost: 0,
            repeated: 0,
            detoured: 0,
            detour: Duration::ZERO,
        }
    }

    /// The longest time that a datagram takes.
    pub(crate) fn longest(&self) -> Duration {
        self.latency.end
    }

    pub(crate) const fn is_lossy(&self) -> bool {
        self.lost > 0
    }
}

/// The network. Hosts are numbered.
pub(crate) struct Air {
    pub(crate) weather: Weather,
    random: Random,
    /// The cut directions, as sender and receiver.
    cut: HashSet<(usize, usize)>,
    flights: BTreeMap<(Duration, u64), Flight>,
    launched: u64,
    ports: Vec<Arc<Mutex<PortState>>>,
}

struct Flight {
    from: usize,
    to: usize,
    octets: Bytes,
}

/// What a host's link has sent and has to receive.
#[derive(Default)]
struct PortState {
    /// The program that has the link; messages of an earlier one are dropped.
    program: u64,
    sent: Vec<(Option<usize>, Bytes)>,
    received: VecDeque<(usize, Bytes)>,
    waker: Option<Waker>,
}

impl Air {
    pub(crate) fn new(seed: u64, hosts: usize) -> Self {
        Self {
            weather: Weather::good(),
            random: Random::new(seed),
            cut: HashSet::new(),
            flights: BTreeMap::new(),
            launched: 0,
            ports: (0..hosts).map(|_| Arc::default()).collect(),
        }
    }

    /// Takes the link from a host's program: what it still sends is lost.
    pub(crate) fn unplug(&self, host: usize) {
        let mut port = lock(&self.ports[host]);
        *port = PortState {
            program: port.program + 1,
            ..PortState::default()
        };
    }

    /// The link of a host's new program.
    pub(crate) fn plug(&self, host: usize) -> Box<dyn CustomLink> {
        self.unplug(host);
        Box::new(AirLink {
            program: lock(&self.ports[host]).program,
            port: Arc::clone(&self.ports[host]),
        })
    }

    /// Cuts or restores the network between two hosts.
    pub(crate) fn set_cut(&mut self, one: usize, other: usize, is_cut: bool) {
        for pair in [(one, other), (other, one)] {
            if is_cut {
                self.cut.insert(pair);
            } else {
                self.cut.remove(&pair);
            }
        }
    }

    pub(crate) fn is_cut(&self, one: usize, other: usize) -> bool {
        self.cut.contains(&(one, other))
    }

    /// Brings what arrives by now.
    pub(crate) fn deliver(&mut self, now: Duration) {
        while let Some(entry) = self.flights.first_entry() {
            if entry.key().0 > now {
                return;
            }
            let Flight { from, to, octets } = entry.remove();
            let mut port = lock(&self.ports[to]);
            port.received.push_back((from, octets));
            if let Some(waker) = port.waker.take() {
                waker.wake();
            }
        }
    }

    /// Takes what the hosts have sent.
    pub(crate) fn collect(&mut self, now: Duration) {
        for from in 0..self.ports.len() {
            let sent = std::mem::take(&mut lock(&self.ports[from]).sent);
            for (to, octets) in sent {
                match to {
                    Some(to) => self.launch(now, from, to, &octets),
                    None => {
                        for to in (0..self.ports.len()).filter(|to| *to != from) {
                            self.launch(now, from, to, &octets);
                        }
                    }
                }
            }
        }
    }

    fn launch(&mut self, now: Duration, from: usize, to: usize, octets: &Bytes) {
        if self.cut.contains(&(from, to)) {
            return;
        }
        let copies = 1 + u32::from(self.random.happens(self.weather.repeated));
        for _copy in 0..copies {
            if self.random.happens(self.weather.lost) {
                continue;
            }
            let mut arrival = now + self.random.between(&self.weather.latency);
            if self.random.happens(self.weather.detoured) {
                arrival += self.random.between(&(Duration::ZERO..self.weather.detour));
            }
            self.launched += 1;
            let octets = octets.clone();
            self.flights
                .insert((arrival, self.launched), Flight { from, to, octets });
        }
    }
}

fn lock(port: &Mutex<PortState>) -> MutexGuard<'_, PortState> {
    port.lock().expect("no panic")
}

/// The link of one program to the network. A session is a host.
struct AirLink {
    program: u64,
    port: Arc<Mutex<PortState>>,
}

impl std::fmt::Debug for AirLink {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("AirLink")
    }
}

impl CustomLink for AirLink {
    fn name(&self) -> &'static str {
        "air"
    }

    fn transmit(&mut self, transmit: &Transmit) {
        let to = match transmit.to {
            To::Peer(Remote::Session(SessionId(host))) => Some(host as usize),
            _ => None,
        };
        let mut port = lock(&self.port);
        if port.program == self.program {
            port.sent.push((to, transmit.payload.clone()));
        }
    }

    fn poll_flush(&mut self, _cx: &mut Context<'_>, _now: Instant) -> Poll<()> {
        Poll::Ready(())
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>, _now: Instant) -> Poll<Arrival> {
        let mut port = lock(&self.port);
        match port.received.pop_front() {
            Some((from, octets)) => Poll::Ready(Arrival::Datagram {
                session: SessionId(from as u64),
                octets,
            }),
            None => {
                port.waker = Some(cx.waker().clone());
                Poll::Pending
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }

    fn hang_up(&mut self) -> Poll<()> {
        Poll::Ready(())
    }
}
