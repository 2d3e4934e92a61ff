//! An examination over secure links: the peers are those of `--secure-peer`.
#![expect(
    clippy::disallowed_methods,
    reason = "the examination runs in real time"
)]

use std::future::poll_fn;
use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::Duration;

use jaus::address::JausId;
use jaus::endpoint::{LinkId, Remote, SessionId, To, Transmit};
use jaus::link::custom::{self, CustomLink as _};
use jaus::node;
use jaus::wire::Frame;
use jaus_cli::failure::Failure;
use jaus_cli::secure::Secure;
use jaus_secure::SecureLink;
use tokio::time::timeout_at;

use super::case::Send;
use super::seen::{Arrival, Listener};
use super::sockets::{Happening, encoded};

/// How long the peers have to answer the handshake.
const PATIENCE: Duration = Duration::from_secs(5);
/// The longest pause between two turns of the link.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// The sessions with the peers.
pub(super) struct Sessions {
    link: SecureLink,
}

impl Sessions {
    /// Connects to the peers.
    pub(super) async fn open(secure: &Secure, own: JausId) -> Result<Self, Failure> {
        let mut link = secure.open(own, None)?;
        let peers = secure.peers();
        let reached = link.probe(&peers, PATIENCE).await;
        if reached.iter().any(Result::is_ok) {
            return Ok(Self { link });
        }
        let faults = peers.iter().zip(reached);
        let faults = faults.filter_map(|(peer, it)| Some((peer, it.err()?)));
        let faults = faults.map(|(peer, fault)| {
            let remedy = fault.remedy().map(|it| format!("; {it}"));
            format!(
                "no secure link with {peer}: {fault}{}",
                remedy.unwrap_or_default()
            )
        });
        Err(Failure::new(faults.collect::<Vec<_>>().join("\n")))
    }

    /// The names of the peers.
    pub(super) fn names(&self) -> String {
        let names: Vec<_> = self
            .link
            .transport()
            .sessions()
            .map(|it| it.peer.name)
            .collect();
        format!("a secure link with {}", names.join(", "))
    }

    /// Queues a message.
    pub(super) fn send(&mut self, send: &Send) {
        let (to, frame) = match send {
            Send::To(address, frame) | Send::Probe(address, frame) => {
                let sessions = self.link.transport().sessions();
                let mut sessions = sessions.filter(|it| it.address == *address);
                match sessions.next() {
                    Some(it) => (To::Peer(Remote::Session(it.session)), frame),
                    None => return,
                }
            }
            Send::Group(frame) => (To::Group, frame),
            // A secure link has no other ports.
            Send::Connect(_) => return,
        };
        self.link.transmit(&transmit(to, frame));
    }

    /// Waits for the next event.
    pub(super) async fn next(&mut self) -> Happening {
        loop {
            let latest = node::now() + LONGEST_PAUSE;
            let due = self
                .link
                .poll_timeout()
                .map_or(latest, |due| due.min(latest));
            let turn = poll_fn(|cx| self.turn(cx));
            if let Ok(arrival) = timeout_at(due.into(), turn).await {
                return Happening::Arrived(arrival);
            }
        }
    }

    /// Sends and receives; ready with a datagram.
    fn turn(&mut self, cx: &mut Context<'_>) -> Poll<Arrival> {
        let now = node::now();
        let _ = self.link.poll_flush(cx, now);
        while let Poll::Ready(arrival) = self.link.poll_receive(cx, now) {
            let custom::Arrival::Datagram { session, octets } = arrival else {
                continue;
            };
            if let Some(from) = self.address_of(session) {
                return Poll::Ready(Arrival {
                    listener: Listener::Unicast,
                    link: 0,
                    from,
                    datagram: octets,
                });
            }
        }
        // Acknowledgements of what was received.
        let _ = self.link.poll_flush(cx, now);
        Poll::Pending
    }

    fn address_of(&self, session: SessionId) -> Option<SocketAddr> {
        let mut sessions = self.link.transport().sessions();
        sessions
            .find(|it| it.session == session)
            .map(|it| it.address)
    }

    /// Sends what is queued, and tells the peers that this was all.
    pub(super) async fn end(&mut self) {
        const FAREWELL: Duration = Duration::from_millis(250);
        let farewell = poll_fn(|cx| {
            let now = node::now();
            let _ = self.link.poll_flush(cx, now);
            let has_ended = self.link.hang_up();
            let _ = self.link.poll_flush(cx, now);
            has_ended
        });
        // A peer that does not answer needs no farewell.
        let _ = tokio::time::timeout(FAREWELL, farewell).await;
    }
}

fn transmit(to: To, frame: &Frame) -> Transmit {
    Transmit {
        // The link is the only one.
        link: LinkId(0),
        to,
        priority: frame.flags.priority(),
        payload: encoded(frame),
        segment: None,
    }
}
