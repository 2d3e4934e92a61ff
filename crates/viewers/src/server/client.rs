//! One connected viewer: its subscriptions, and the queue of its samples.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::{Error, Message};

use super::Shared;
use crate::channels::MOST_CHANNELS;
use crate::protocol::{self, MESSAGE_DATA_HEADER, Request, Subscription};

/// Limit of samples that wait for a client: the latest of all channels, and as many new ones.
const WAITING: usize = 2 * MOST_CHANNELS;
/// Limit of octets that wait for a client. The latest samples of all channels take up to 12 MiB.
const WAITING_OCTETS: usize = 16 << 20;
/// A client that accepts no data for this time is disconnected.
const STUCK: Duration = Duration::from_secs(30);
/// Interval of pings, which clients answer by themselves.
const PING: Duration = Duration::from_secs(10);
/// A client that sends nothing for this time, not even answers to pings, is disconnected.
const SILENCE: Duration = Duration::from_secs(60);
/// Limit of a client's messages in a second. Further ones wait for the next second.
const REQUESTS: u32 = 50;
/// Least interval of warnings to a client that never catches up.
const WARNING: Duration = Duration::from_secs(1);
/// Channels that are announced in one message.
const TOGETHER: usize = 64;

type Socket = WebSocketStream<TcpStream>;

/// What a client has subscribed to, and what waits for it.
#[derive(Debug)]
pub(super) struct Client {
    /// The client's numbers of its subscriptions, by channel.
    subscriptions: Mutex<BTreeMap<usize, u32>>,
    queue: mpsc::Sender<Bytes>,
    waiting_octets: AtomicUsize,
    lost: AtomicU64,
}

impl Client {
    fn new() -> (Arc<Self>, mpsc::Receiver<Bytes>) {
        let (queue, waiting) = mpsc::channel(WAITING);
        let client = Self {
            subscriptions: Mutex::default(),
            queue,
            waiting_octets: AtomicUsize::new(0),
            lost: AtomicU64::new(0),
        };
        (Arc::new(client), waiting)
    }

    /// The number of the subscription to a channel.
    pub(super) fn subscription_to(&self, channel: usize) -> Option<u32> {
        self.subscriptions().get(&channel).copied()
    }

    /// Queues a sample; counts it as lost and returns false if the queue is full.
    pub(super) fn offer(&self, subscription: u32, time: u64, data: &[u8]) -> bool {
        let length = MESSAGE_DATA_HEADER + data.len();
        let waiting = self.waiting_octets.fetch_add(length, Ordering::Relaxed);
        // Copied only if there is room.
        let is_queued = waiting + length <= WAITING_OCTETS
            && self.queue.try_reserve().is_ok_and(|place| {
                place.send(protocol::message_data(subscription, time, data));
                true
            });
        if !is_queued {
            self.taken(length);
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        is_queued
    }

    /// The number of lost samples, if it is time for a warning of them: when the client has caught
    /// up, and once a second at most while it does not. `warned` is the time of the last one.
    fn lost_to_tell(
        &self,
        warned: &mut Option<Instant>,
        now: Instant,
        has_caught_up: bool,
    ) -> Option<u64> {
        let is_due = warned.is_none_or(|at| now.saturating_duration_since(at) >= WARNING);
        if !has_caught_up && !is_due {
            return None;
        }
        let lost = self.lost.swap(0, Ordering::Relaxed);
        let lost = (lost > 0).then_some(lost)?;
        *warned = Some(now);
        Some(lost)
    }

    /// Notes that octets wait no more.
    fn taken(&self, length: usize) {
        self.waiting_octets.fetch_sub(length, Ordering::Relaxed);
    }

    /// Applies a request; returns why it is refused.
    fn handle(&self, request: Request, shared: &Shared) -> Option<&'static str> {
        match request {
            Request::Subscribe { subscriptions } => {
                let mut new = subscriptions.into_iter();
                new.find_map(|it| self.subscribe(it, shared).err())
            }
            Request::Unsubscribe { subscription_ids } => {
                let mut subscriptions = self.subscriptions();
                for id in subscription_ids {
                    subscriptions.retain(|_, it| *it != id);
                }
                None
            }
            Request::Other => None,
        }
    }

    /// Adds a subscription, and queues the latest sample of its channel.
    fn subscribe(&self, new: Subscription, shared: &Shared) -> Result<(), &'static str> {
        let channel = usize::try_from(new.channel_id).unwrap_or(usize::MAX);
        let latest = shared.latest();
        let mut subscriptions = self.subscriptions();
        if subscriptions.len() >= MOST_CHANNELS {
            return Err("the limit of subscriptions is reached");
        }
        if subscriptions.contains_key(&channel) {
            return Err("there is a subscription to this channel already");
        }
        if subscriptions.values().any(|&it| it == new.id) {
            return Err("another subscription has this id");
        }
        subscriptions.insert(channel, new.id);
        if let Some(sample) = latest.of(channel) {
            shared.offer(self, new.id, sample.time, &sample.data);
        }
        Ok(())
    }

    fn subscriptions(&self) -> MutexGuard<'_, BTreeMap<usize, u32>> {
        let subscriptions = self.subscriptions.lock();
        subscriptions.unwrap_or_else(PoisonError::into_inner)
    }
}

/// Serves a client until it has gone.
pub(super) async fn serve(shared: &Shared, socket: Socket) {
    let (client, waiting) = Client::new();
    shared.clients().push(client.clone());
    let (sink, stream) = socket.split();
    let (replies, refused) = mpsc::channel(1);
    let writer = Writer {
        shared,
        client: &client,
        sink,
        announced: BTreeSet::new(),
        warned: None,
    };
    tokio::select! {
        ended = writer.run(waiting, refused) => {
            if let Err(error) = ended {
                tracing::debug!(%error, "a viewer's connection has ended");
            }
        }
        () = read(shared, &client, stream, &replies) => {}
    }
    shared.clients().retain(|it| !Arc::ptr_eq(it, &client));
}

/// Reads requests until the client has gone, or says nothing for too long.
#[expect(clippy::disallowed_methods, reason = "clients run in real time")]
async fn read(
    shared: &Shared,
    client: &Client,
    mut stream: SplitStream<Socket>,
    replies: &mpsc::Sender<String>,
) {
    let (mut second, mut count) = (Instant::now(), 0);
    while let Ok(Some(Ok(message))) = tokio::time::timeout(SILENCE, stream.next()).await {
        let refusal = match message {
            Message::Text(text) => match protocol::read(&text) {
                Ok(request) => client.handle(request, shared).map(str::to_owned),
                Err(error) => Some(format!("a request that cannot be read: {error}")),
            },
            Message::Close(_) => return,
            // Requests for what the server does not offer, and answers to pings.
            _ => None,
        };
        if let Some(refusal) = refusal {
            // One at a time: further mistakes in the meantime get no reply.
            let _ = replies.try_send(protocol::warning(&refusal));
        }
        count += 1;
        if second.elapsed() >= Duration::from_secs(1) {
            (second, count) = (Instant::now(), 0);
        } else if count >= REQUESTS {
            tokio::time::sleep_until(second + Duration::from_secs(1)).await;
        }
    }
}

/// Sends announcements, samples, warnings and pings.
struct Writer<'s> {
    shared: &'s Shared,
    client: &'s Client,
    sink: SplitSink<Socket, Message>,
    /// The channels that were announced.
    announced: BTreeSet<usize>,
    /// When it was warned last of lost samples.
    warned: Option<Instant>,
}

impl Writer<'_> {
    async fn run(
        mut self,
        mut waiting: mpsc::Receiver<Bytes>,
        mut refused: mpsc::Receiver<String>,
    ) -> Result<(), Error> {
        let settings = &self.shared.settings;
        let info = protocol::server_info(&settings.name, &settings.session);
        self.send(Message::text(info)).await?;
        let mut opened = self.shared.opened.subscribe();
        self.announce().await?;
        let mut turns = interval(PING);
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        turns.reset();
        loop {
            tokio::select! {
                changed = opened.changed() => {
                    if changed.is_err() {
                        return Ok(());
                    }
                    self.announce().await?;
                }
                Some(data) = waiting.recv() => {
                    let length = data.len();
                    let sent = self.send(Message::Binary(data)).await;
                    self.client.taken(length);
                    sent?;
                    self.tell_lost(waiting.is_empty()).await?;
                }
                Some(refusal) = refused.recv() => self.send(Message::text(refusal)).await?,
                _ = turns.tick() => self.send(Message::Ping(Bytes::new())).await?,
            }
        }
    }

    /// Announces the channels that are new, and those that are closed.
    async fn announce(&mut self) -> Result<(), Error> {
        let (new, closed) = self.shared.changes(&self.announced);
        if !closed.is_empty() {
            for channel in &closed {
                self.announced.remove(channel);
                self.client.subscriptions().remove(channel);
            }
            let text = protocol::unadvertise(&closed);
            self.send(Message::text(text)).await?;
        }
        for some in new.chunks(TOGETHER) {
            let text = protocol::advertise(some.iter().map(AsRef::as_ref));
            self.send(Message::text(text)).await?;
            self.announced.extend(some.iter().map(|it| it.index));
        }
        Ok(())
    }

    /// Warns the client of lost samples, with their number, if it is time.
    async fn tell_lost(&mut self, has_caught_up: bool) -> Result<(), Error> {
        #[expect(clippy::disallowed_methods, reason = "clients run in real time")]
        let now = Instant::now();
        let lost = self
            .client
            .lost_to_tell(&mut self.warned, now, has_caught_up);
        let Some(lost) = lost else {
            return Ok(());
        };
        let words = format!("{lost} messages lost: this viewer reads too slowly");
        self.send(Message::text(protocol::warning(&words))).await
    }

    async fn send(&mut self, message: Message) -> Result<(), Error> {
        #[expect(clippy::disallowed_methods, reason = "clients run in real time")]
        let sent = tokio::time::timeout(STUCK, self.sink.send(message)).await;
        sent.unwrap_or_else(|_| Err(Error::Io(std::io::ErrorKind::TimedOut.into())))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use jaus_view::Dictionary;
    use serde_json::Value as Json;

    use super::*;
    use crate::server::latest::tests::full;
    use crate::{Channels, Sample, Server, ServerSettings};

    fn shared() -> Arc<Shared> {
        Server::new(ServerSettings::default()).0.shared
    }

    fn subscribe(id: u32, channel_id: u64) -> Request {
        let subscriptions = vec![Subscription { id, channel_id }];
        Request::Subscribe { subscriptions }
    }

    #[test]
    fn a_queue_is_bounded_in_messages_and_octets_and_losses_are_counted() {
        let (client, mut waiting) = Client::new();
        for _ in 0..WAITING {
            assert!(client.offer(7, 5, b"x"));
        }
        assert!(!client.offer(7, 5, b"x"));
        assert_eq!(client.lost.load(Ordering::Relaxed), 1);
        while let Ok(data) = waiting.try_recv() {
            client.taken(data.len());
        }
        let large = vec![0; WAITING_OCTETS - MESSAGE_DATA_HEADER];
        assert!(client.offer(7, 5, &large));
        assert!(!client.offer(7, 5, &large));
        assert_eq!(client.lost.load(Ordering::Relaxed), 2);
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "the test starts at an arbitrary instant"
    )]
    fn a_client_that_never_catches_up_is_warned_once_a_second() {
        let (client, _waiting) = Client::new();
        let (start, mut warned) = (Instant::now(), None);
        let mut lose = |number, after, has_caught_up| {
            client.lost.fetch_add(number, Ordering::Relaxed);
            client.lost_to_tell(&mut warned, start + after, has_caught_up)
        };
        assert_eq!(lose(3, Duration::ZERO, false), Some(3));
        assert_eq!(lose(4, WARNING / 2, false), None);
        assert_eq!(lose(5, WARNING, false), Some(9));
        assert_eq!(lose(6, WARNING, true), Some(6), "it has caught up");
        assert_eq!(lose(0, 3 * WARNING, true), None);
    }

    #[test]
    fn subscriptions_are_bounded_and_end_when_the_client_says_so() {
        let (shared, (client, _waiting)) = (shared(), Client::new());
        assert_eq!(client.handle(subscribe(7, 3), &shared), None);
        assert_eq!(client.handle(subscribe(8, 4), &shared), None);
        assert_eq!(client.subscription_to(3), Some(7));
        assert_eq!(client.subscription_to(5), None);
        let unsubscribe = Request::Unsubscribe {
            subscription_ids: vec![7, 99],
        };
        assert_eq!(client.handle(unsubscribe, &shared), None);
        assert_eq!(client.subscription_to(3), None);
        assert_eq!(client.subscription_to(4), Some(8));
        let many = (100..).take(MOST_CHANNELS);
        let many = many.map(|it: u32| client.handle(subscribe(it, it.into()), &shared));
        assert_eq!(many.flatten().count(), 1, "one too many is refused");
        assert_eq!(client.subscriptions().len(), MOST_CHANNELS);
    }

    #[test]
    fn a_channel_and_a_number_have_one_subscription() {
        // With thousands of them to one channel, a client would delay the samples of all others.
        let (shared, (client, mut waiting)) = (shared(), Client::new());
        shared.latest().keep(3, 5, b"{}".to_vec());
        assert_eq!(client.handle(subscribe(7, 3), &shared), None);
        assert!(client.handle(subscribe(8, 3), &shared).is_some());
        assert!(client.handle(subscribe(7, 4), &shared).is_some());
        assert_eq!(client.subscription_to(3), Some(7));
        assert_eq!(client.subscription_to(4), None);
        assert!(waiting.try_recv().is_ok());
        assert!(waiting.try_recv().is_err());
    }

    #[test]
    fn each_subscription_gets_the_latest_sample_of_its_channel_with_its_time() {
        let (shared, (client, mut waiting)) = (shared(), Client::new());
        shared.latest().keep(3, 5, b"{}".to_vec());
        client.handle(subscribe(7, 3), &shared);
        client.handle(subscribe(8, 4), &shared);
        let expected = protocol::message_data(7, 5, b"{}");
        assert_eq!(waiting.try_recv().ok(), Some(expected));
        assert!(waiting.try_recv().is_err(), "channel 4 has no sample");
    }

    #[test]
    fn no_sample_is_missed_or_sent_twice_if_it_is_published_while_clients_subscribe() {
        const CLIENTS: usize = 30;
        const LAST: u64 = 100;
        let dictionary = Dictionary::new();
        let channels = Channels::new(&dictionary);
        for _ in 0..200 {
            let (server, sharing) = Server::new(ServerSettings::default());
            let clients: Vec<_> = (0..CLIENTS).map(|_| Client::new()).collect();
            let all = clients.iter().map(|(client, _)| client.clone());
            server.shared.clients().extend(all);
            let start = Barrier::new(2);
            std::thread::scope(|threads| {
                threads.spawn(|| {
                    start.wait();
                    for time in 1..=LAST {
                        let (channel, value) = (3, Json::Null);
                        let sample = Sample {
                            channel,
                            time,
                            value,
                        };
                        sharing.publish(&channels, &[sample]);
                    }
                });
                start.wait();
                for (client, _) in &clients {
                    client.handle(subscribe(7, 3), &server.shared);
                }
            });
            for (_, mut waiting) in clients {
                let received = std::iter::from_fn(|| waiting.try_recv().ok());
                let time = |data: Bytes| u64::from_le_bytes(data[5..13].try_into().unwrap());
                let times: Vec<_> = received.map(time).collect();
                assert_eq!(times, Vec::from_iter(times[0]..=LAST));
            }
        }
    }

    #[test]
    fn a_viewer_that_subscribes_to_everything_loses_nothing() {
        let (shared, (client, mut waiting)) = (shared(), Client::new());
        *shared.latest() = full();
        for channel in 0..MOST_CHANNELS {
            client.handle(subscribe(channel as u32, channel as u64), &shared);
        }
        assert_eq!(shared.lost.load(Ordering::Relaxed), 0);
        assert_eq!(
            std::iter::from_fn(|| waiting.try_recv().ok()).count(),
            MOST_CHANNELS
        );
    }
}
