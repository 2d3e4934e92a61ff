//! One connected viewer: its subscriptions, and the queue of its samples.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use tokio::net::TcpStream;
use tokio::sync::{mpsc, watch};
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
/// Channels that are announced in one message.
const TOGETHER: usize = 64;

type Socket = WebSocketStream<TcpStream>;

/// What a client has subscribed to, and what waits for it.
#[derive(Debug)]
pub(super) struct Client {
    /// The channels of the subscriptions, by the client's numbers.
    subscriptions: Mutex<BTreeMap<u32, usize>>,
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

    /// The numbers of the subscriptions to a channel.
    pub(super) fn subscriptions_to(&self, channel: usize) -> Vec<u32> {
        let subscriptions = self.subscriptions();
        let of_channel = subscriptions.iter().filter(|(_, it)| **it == channel);
        of_channel.map(|(&id, _)| id).collect()
    }

    /// Queues a sample; counts it as lost and returns false if the queue is full.
    pub(super) fn offer(&self, subscription: u32, time: u64, data: &[u8]) -> bool {
        let length = MESSAGE_DATA_HEADER + data.len();
        let waiting = self.waiting_octets.fetch_add(length, Ordering::Relaxed);
        // Copied only if there is room: a client may subscribe to a large sample many times.
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
                    subscriptions.remove(&id);
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
        subscriptions.insert(new.id, channel);
        if let Some(sample) = latest.of(channel) {
            shared.offer(self, new.id, sample.time, &sample.data);
        }
        Ok(())
    }

    fn subscriptions(&self) -> MutexGuard<'_, BTreeMap<u32, usize>> {
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
        announced: 0,
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
    /// Number of channels that were announced.
    announced: usize,
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
        let mut count = self.shared.count.subscribe();
        let mut turns = interval(PING);
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        turns.reset();
        loop {
            self.announce(&mut count).await?;
            tokio::select! {
                changed = count.changed() => {
                    if changed.is_err() {
                        return Ok(());
                    }
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

    /// Announces the channels that are new.
    async fn announce(&mut self, count: &mut watch::Receiver<usize>) -> Result<(), Error> {
        while self.announced < *count.borrow_and_update() {
            let new = self.shared.channels_from(self.announced);
            for some in new.chunks(TOGETHER) {
                let text = protocol::advertise(some.iter().map(AsRef::as_ref));
                self.send(Message::text(text)).await?;
                self.announced += some.len();
            }
        }
        Ok(())
    }

    /// Warns the client of lost samples, with their number, once it has caught up.
    async fn tell_lost(&mut self, has_caught_up: bool) -> Result<(), Error> {
        if !has_caught_up {
            return Ok(());
        }
        match self.client.lost.swap(0, Ordering::Relaxed) {
            0 => Ok(()),
            lost => {
                let words = format!("{lost} messages lost: this viewer reads too slowly");
                self.send(Message::text(protocol::warning(&words))).await
            }
        }
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

    /// Subscribes to a channel with `count` numbers from `first` on.
    fn subscribe(channel_id: u64, first: u32, count: usize) -> Request {
        let numbers = (first..).take(count);
        Request::Subscribe {
            subscriptions: numbers.map(|id| Subscription { id, channel_id }).collect(),
        }
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
    fn subscriptions_are_bounded_and_end_when_the_client_says_so() {
        let (shared, (client, _waiting)) = (shared(), Client::new());
        assert_eq!(client.handle(subscribe(3, 7, 2), &shared), None);
        assert_eq!(client.subscriptions_to(3), [7, 8]);
        assert!(client.subscriptions_to(4).is_empty());
        let unsubscribe = Request::Unsubscribe {
            subscription_ids: vec![7, 99],
        };
        assert_eq!(client.handle(unsubscribe, &shared), None);
        assert_eq!(client.subscriptions_to(3), [8]);
        let most = subscribe(3, 100, MOST_CHANNELS);
        assert!(client.handle(most, &shared).is_some());
        assert_eq!(client.subscriptions().len(), MOST_CHANNELS);
    }

    #[test]
    fn each_subscription_gets_the_latest_sample_of_its_channel_with_its_time() {
        let (shared, (client, mut waiting)) = (shared(), Client::new());
        shared.latest().keep(3, 5, b"{}".to_vec());
        client.handle(subscribe(3, 7, 1), &shared);
        client.handle(subscribe(4, 8, 1), &shared);
        let expected = protocol::message_data(7, 5, b"{}");
        assert_eq!(waiting.try_recv().ok(), Some(expected));
        assert!(waiting.try_recv().is_err(), "channel 4 has no sample");
    }

    #[test]
    fn no_sample_is_missed_or_sent_twice_if_it_is_published_while_a_client_subscribes() {
        const SUBSCRIPTIONS: u32 = 30;
        const LAST: u64 = 100;
        let dictionary = Dictionary::new();
        let channels = Channels::new(&dictionary);
        for _ in 0..200 {
            let (server, sharing) = Server::new(ServerSettings::default());
            let (client, mut waiting) = Client::new();
            server.shared.clients().push(client.clone());
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
                for id in 0..SUBSCRIPTIONS {
                    client.handle(subscribe(3, id, 1), &server.shared);
                }
            });
            let mut received = BTreeMap::<u32, Vec<u64>>::new();
            while let Ok(data) = waiting.try_recv() {
                let id = u32::from_le_bytes(data[1..5].try_into().unwrap());
                let time = u64::from_le_bytes(data[5..13].try_into().unwrap());
                received.entry(id).or_default().push(time);
            }
            for times in received.values() {
                assert_eq!(*times, Vec::from_iter(times[0]..=LAST));
            }
            assert_eq!(received.len(), SUBSCRIPTIONS as usize);
        }
    }

    #[test]
    fn a_viewer_that_subscribes_to_everything_loses_nothing() {
        let (shared, (client, mut waiting)) = (shared(), Client::new());
        *shared.latest() = full();
        for channel in 0..MOST_CHANNELS {
            client.handle(subscribe(channel as u64, channel as u32, 1), &shared);
        }
        assert_eq!(shared.lost.load(Ordering::Relaxed), 0);
        assert_eq!(
            std::iter::from_fn(|| waiting.try_recv().ok()).count(),
            MOST_CHANNELS
        );
    }

    #[test]
    fn a_large_sample_that_is_subscribed_to_many_times_is_lost_and_counted() {
        let (shared, (client, _waiting)) = (shared(), Client::new());
        *shared.latest() = full();
        client.handle(subscribe(0, 0, MOST_CHANNELS), &shared);
        let waiting = client.waiting_octets.load(Ordering::Relaxed);
        assert!(waiting <= WAITING_OCTETS, "{waiting}");
        let lost = shared.lost.load(Ordering::Relaxed);
        assert_eq!(lost, client.lost.load(Ordering::Relaxed));
        assert!(lost > 4000, "{lost}");
    }
}
