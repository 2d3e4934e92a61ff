//! Where the messages come from: a debug view, or network interfaces.

use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use jaus::link::Group;
use jaus_cli::failure::Failure;
use jaus_cli::output::say;
use jaus_view::{Dictionary, Entry, Filter, MessageStream, Network, Timestamp};
use jaus_viewers::nanoseconds;

use crate::debug_view::DebugView;
use crate::packets;

/// Pause before a debug view is tried again.
const PAUSE: Duration = Duration::from_secs(1);

/// A source of messages.
pub(super) struct Source<'d> {
    messages: MessageStream<'d>,
    origin: Origin,
}

enum Origin {
    DebugView {
        address: String,
        /// `None` while it is gone.
        view: Option<DebugView>,
    },
    Interfaces {
        packets: Box<packets::Source>,
        network: Box<Network>,
    },
}

/// A message that has arrived.
pub(super) struct Arrival {
    pub(super) entry: Entry,
    /// The network address that it came from, if it came from another host.
    pub(super) from: Option<IpAddr>,
    /// Nanoseconds since 1970.
    pub(super) time: u64,
}

impl<'d> Source<'d> {
    /// Connects to a debug view.
    pub(super) async fn debug_view(
        address: &str,
        dictionary: &'d Dictionary,
    ) -> Result<Self, Failure> {
        let view = DebugView::connect(address, &Filter::default()).await?;
        Ok(Self {
            messages: MessageStream::new(dictionary, Filter::default()),
            origin: Origin::DebugView {
                address: address.to_owned(),
                view: Some(view),
            },
        })
    }

    /// Opens network interfaces.
    pub(super) fn interfaces(
        names: &[String],
        group: Group,
        dictionary: &'d Dictionary,
    ) -> Result<Self, Failure> {
        Ok(Self {
            messages: MessageStream::new(dictionary, Filter::default()),
            origin: Origin::Interfaces {
                packets: Box::new(packets::Source::open(names, group)?),
                network: Box::new(Network::by_content()),
            },
        })
    }

    /// Waits for messages. A debug view that has gone is awaited.
    pub(super) async fn next(&mut self) -> Result<Vec<Arrival>, Failure> {
        match &mut self.origin {
            Origin::DebugView { address, view } => {
                let text = next_text(address, view).await;
                match self.messages.read_json(&text) {
                    Ok(entry) => Ok(entry.into_iter().map(arrival).collect()),
                    Err(_) => Err(Failure::new(format!("{address} sends no JSON objects"))),
                }
            }
            Origin::Interfaces { packets, network } => {
                let mut messages = Vec::new();
                for packet in packets.next().await? {
                    for datagram in network.handle_frame(&packet.frame()) {
                        let entries = self.messages.read_datagram(Some(packet.time), &datagram);
                        let time = nanoseconds(packet.time);
                        let from = Some(datagram.source.ip());
                        messages.extend(entries.into_iter().map(|entry| Arrival {
                            entry,
                            from,
                            time,
                        }));
                    }
                }
                Ok(messages)
            }
        }
    }
}

/// The next text of a debug view, which is connected again when it has gone.
async fn next_text(address: &str, view: &mut Option<DebugView>) -> String {
    loop {
        if let Some(connected) = view {
            if let Some(text) = connected.next().await {
                return text;
            }
            say(format_args!(
                "{address} closed the connection; waiting for it"
            ));
            *view = None;
        }
        #[expect(clippy::disallowed_methods, reason = "a command runs in real time")]
        tokio::time::sleep(PAUSE).await;
        if let Ok(connected) = DebugView::connect(address, &Filter::default()).await {
            say(format_args!("{address} is there again"));
            *view = Some(connected);
        }
    }
}

/// A message of a debug view, with its time, or the time of day.
fn arrival(entry: Entry) -> Arrival {
    let time = entry
        .text("time")
        .and_then(|time| time.parse::<Timestamp>().ok());
    let time = time.map_or_else(now, nanoseconds);
    // The peer of outgoing messages is their destination.
    let is_foreign = matches!(entry.text("direction"), Some("received" | "passing"));
    let peer = entry.text("peer").filter(|_| is_foreign);
    let from = peer.and_then(|peer| peer.parse::<SocketAddr>().ok());
    Arrival {
        from: from.map(|it| it.ip()),
        entry,
        time,
    }
}

/// The time of day in nanoseconds since 1970.
pub(super) fn now() -> u64 {
    #[expect(clippy::disallowed_methods, reason = "viewers show the time of day")]
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    nanoseconds(Timestamp::since_1970(now.unwrap_or_default(), 9))
}
