//! A server for live viewers: Foxglove's WebSocket protocol, read-only.
//!
//! It accepts [`MOST_CLIENTS`] connections, half as many from one address, and refuses more. A
//! subscription starts with the latest sample of its channel, at its original time. A client that
//! reads too slowly loses samples and gets a warning with their number. Publishing never waits for a
//! client.

mod client;
mod handshake;
mod latest;

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Duration;

use jaus_limits::{Place, Places, Source};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::channels::{Channel, Channels, Sample};
use client::Client;
use latest::Latest;

/// Limit of connections, including those whose handshake is not complete.
pub const MOST_CLIENTS: usize = 32;
/// Pause after an error of the listener, for example too many open files.
const PAUSE: Duration = Duration::from_millis(100);
/// The reply to another user of this host: the debug view is closed to them, too.
const NOT_OURS: &[u8] = b"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain\r\n\
    Content-Length: 44\r\nConnection: close\r\n\r\nother users of this host may not watch this\n";
/// The reply to a connection beyond the limit.
const NO_PLACE: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\n\
    Content-Length: 46\r\nConnection: close\r\n\r\nthe limit of viewers is reached: close another\n";

/// Settings of a [`Server`].
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct ServerSettings {
    /// The name that viewers show.
    pub name: String,
    /// Names the run of the server: viewers keep their data as long as it is the same.
    pub session: String,
    /// Web pages that may connect besides those of this host, of Foxglove and of files, as browsers
    /// name them: `https://viewer.example`.
    pub origins: Vec<String>,
}

impl ServerSettings {
    /// Settings with a name.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Names the run of the server.
    #[must_use]
    pub fn session(self, session: impl Into<String>) -> Self {
        Self {
            session: session.into(),
            ..self
        }
    }

    /// Lets the pages of a site connect.
    #[must_use]
    pub fn origin(mut self, origin: impl Into<String>) -> Self {
        self.origins.push(origin.into());
        self
    }
}

/// Serves the channels and samples that are published through its [`Sharing`].
#[derive(Debug)]
pub struct Server {
    shared: Arc<Shared>,
}

/// Publishes samples to the clients of a [`Server`].
#[derive(Debug, Clone)]
pub struct Sharing(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    settings: ServerSettings,
    channels: RwLock<BTreeMap<usize, Arc<Channel>>>,
    /// How many channels were opened, for the clients to announce changes. None is closed but for a new
    /// one.
    opened: watch::Sender<usize>,
    /// Locked while samples or a subscription are handled, before the locks of the clients: so a
    /// subscription gets each sample once, either as the latest or when it is published.
    latest: Mutex<Latest>,
    /// At most as many as there are places.
    clients: Mutex<Vec<Arc<Client>>>,
    lost: AtomicU64,
}

impl Server {
    /// Creates a server without channels, and the other end to publish them.
    #[must_use]
    pub fn new(settings: ServerSettings) -> (Self, Sharing) {
        let shared = Arc::new(Shared {
            settings,
            channels: RwLock::default(),
            opened: watch::Sender::new(0),
            latest: Mutex::default(),
            clients: Mutex::new(Vec::new()),
            lost: AtomicU64::new(0),
        });
        let sharing = Sharing(shared.clone());
        (Self { shared }, sharing)
    }

    /// Serves clients for as long as the future lives.
    pub async fn serve(self, listener: TcpListener) -> Infallible {
        let places = Places::new(MOST_CLIENTS, MOST_CLIENTS / 2);
        let mut tasks = JoinSet::new();
        loop {
            let accepted = tokio::select! {
                accepted = listener.accept() => accepted,
                Some(_) = tasks.join_next() => continue,
            };
            match accepted {
                Ok((stream, address)) if is_of_another_user(&stream, address) => {
                    refuse(&stream, address, NOT_OURS, "a viewer of another user");
                }
                Ok((stream, address)) => match places.take(Source::of(address)) {
                    Ok(place) => {
                        tasks.spawn(serve(self.shared.clone(), stream, address, place));
                    }
                    Err(_) => refuse(&stream, address, NO_PLACE, "a viewer too many"),
                },
                Err(error) => pause_after(&error).await,
            }
        }
    }
}

async fn serve(shared: Arc<Shared>, stream: TcpStream, address: SocketAddr, _place: Place) {
    // Samples are small, and each is worth sending at once. A failure only adds latency.
    let _ = stream.set_nodelay(true);
    match handshake::accept(stream, &shared.settings.origins).await {
        Ok(socket) => {
            tracing::info!(%address, "a viewer has connected");
            client::serve(&shared, socket).await;
            tracing::info!(%address, "a viewer has gone");
        }
        Err(reason) => tracing::info!(%address, reason, "no viewer"),
    }
}

fn is_of_another_user(stream: &TcpStream, peer: SocketAddr) -> bool {
    let here = stream.local_addr();
    here.is_ok_and(|here| jaus::link::is_of_another_user(peer, here))
}

fn refuse(stream: &TcpStream, address: SocketAddr, answer: &[u8], why: &str) {
    tracing::info!(%address, "{why}");
    // Best effort: never wait for the peer.
    let _ = stream.try_write(answer);
}

#[expect(
    clippy::disallowed_methods,
    reason = "the server's pause is in real time"
)]
async fn pause_after(error: &io::Error) {
    tracing::warn!(%error, "cannot accept connections");
    tokio::time::sleep(PAUSE).await;
}

impl Sharing {
    /// Publishes samples of `channels` to the clients that have subscribed to them, and announces new
    /// channels, and those that are closed. Never waits for a client: one whose queue is full loses samples.
    ///
    /// The latest sample of each channel is kept for clients that subscribe later, if it has at most
    /// 1 KiB, or at most 1 MiB and those of more than 1 KiB have at most 8 MiB together.
    pub fn publish(&self, channels: &Channels<'_>, samples: &[Sample]) {
        let shared = &self.0;
        let mut latest = shared.latest();
        if self.announce(channels) {
            latest.forget(|channel| channels.get(channel).is_none());
        }
        let clients = shared.clients();
        for sample in samples {
            // Serialising to memory fails only for non-text map keys, which do not occur.
            let data = serde_json::to_vec(&sample.value).unwrap_or_default();
            for client in clients.iter() {
                if let Some(subscription) = client.subscription_to(sample.channel) {
                    shared.offer(client, subscription, sample.time, &data);
                }
            }
            latest.keep(sample.channel, sample.time, data);
        }
    }

    /// Number of clients with a complete handshake.
    #[must_use]
    pub fn clients(&self) -> usize {
        self.0.clients().len()
    }

    /// Number of samples that clients have lost because they read too slowly.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.0.lost.load(Ordering::Relaxed)
    }

    /// Announces new channels, and those that are closed; returns whether any is.
    fn announce(&self, new: &Channels<'_>) -> bool {
        let known = *self.0.opened.borrow();
        if known == new.opened() {
            return false;
        }
        let channels = self.0.channels.write();
        let mut channels = channels.unwrap_or_else(PoisonError::into_inner);
        let opened = new.all().range(known..);
        channels.extend(opened.map(|(&index, channel)| (index, channel.clone())));
        let is_any_closed = channels.len() > new.all().len();
        if is_any_closed {
            channels.retain(|&index, _| new.get(index).is_some());
        }
        self.0.opened.send_replace(new.opened());
        is_any_closed
    }
}

impl Shared {
    fn clients(&self) -> MutexGuard<'_, Vec<Arc<Client>>> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn latest(&self) -> MutexGuard<'_, Latest> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Queues a sample for a client, or counts it as lost.
    fn offer(&self, client: &Client, subscription: u32, time: u64, data: &[u8]) {
        if !client.offer(subscription, time, data) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The channels that are not in `announced`, and the numbers in it that are closed.
    fn changes(&self, announced: &BTreeSet<usize>) -> (Vec<Arc<Channel>>, Vec<usize>) {
        let channels = self.channels.read();
        let channels = channels.unwrap_or_else(PoisonError::into_inner);
        let new = channels
            .values()
            .filter(|it| !announced.contains(&it.index));
        let closed = announced.iter().filter(|it| !channels.contains_key(it));
        (new.cloned().collect(), closed.copied().collect())
    }
}
