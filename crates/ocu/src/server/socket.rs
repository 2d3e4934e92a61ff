//! The WebSocket of one page: requests to the session, snapshots and answers back. Reading and
//! writing are independent, so that a page that reads slowly can still stop the vehicle.

use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{FutureExt, SinkExt, StreamExt};
use jaus_limits::Bucket;
use serde_json::{Map, Value};
use tokio::sync::{Notify, mpsc, oneshot, watch};
use tokio::time::{MissedTickBehavior, interval, interval_at, sleep, timeout};

use super::Shared;
use super::bounds::FRAMES;
use super::introduction::Introduction;
use super::view::{self, MessageView};
use super::visitor::Visitor;
use crate::answer::Said as Answer;
use crate::changes::changes;
use crate::orders::{
    DriveOrder, OpenedPage, Order, ReplacedPage, Reply, Snapshot, StopOrder, StopReply, StopTarget,
    json,
};
use crate::ownership::{Owner, PageId};
use crate::page_link::{PageLink, Seen, TooOld};
use crate::press::{KnownStops, Press};
use crate::request::{Frame, MessageFilter, OperatorRequest, Said};
use crate::token::Token;
use crate::users::UserRole;
use jaus::node::now;
use jaus_view::Filter;

/// Version of the protocol between page and station.
const VERSION: u32 = 4;
/// Limit of queued answers per page. Further answers are dropped.
const ANSWERS: usize = 64;
/// A page that accepts no data for this time is disconnected.
const STUCK: Duration = Duration::from_secs(5);
/// Ping interval. Browsers answer pings automatically.
const PING: Duration = Duration::from_secs(5);
/// Number of wrong tokens after which the connection is closed.
const WRONG_TOKENS: u32 = 5;
/// A page that sees nothing without the token is disconnected after this time.
const LOGIN: Duration = Duration::from_secs(60);
/// Interval of checking whether a user's session has ended.
const CHECK: Duration = Duration::from_secs(1);
/// Code of the Close frame at the end of a user's session.
const SESSION_ENDED: u16 = 4001;
/// Minimum interval between refusals of requests without an id.
const REFUSAL: Duration = Duration::from_secs(1);
/// Interval of the frames about the links.
const LINK: Duration = Duration::from_secs(1);

/// The link to the page. The reader notes confirmations, and the writer the states that it sends.
#[derive(Default)]
struct SharedLink {
    link: Mutex<PageLink>,
    /// The link may take another state.
    confirmed: Notify,
}

impl SharedLink {
    fn lock(&self) -> MutexGuard<'_, PageLink> {
        self.link.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Serves a page until either side closes the connection.
pub(super) async fn serve(
    socket: WebSocket,
    shared: Arc<Shared>,
    visitor: Visitor,
    introduction: Introduction,
) {
    let page = PageId(shared.pages.fetch_add(1, Relaxed));
    let visitor = Arc::new(visitor);
    let (states, snapshots) = watch::channel(Snapshot::default());
    // Without random numbers no page can replace this one.
    let secret = Token::generate().ok();
    let replaced = introduction.replaces.zip(introduction.secret);
    let opened = OpenedPage {
        operator: Owner {
            page,
            user: Arc::clone(&visitor.user),
        },
        vehicle: introduction.vehicle,
        secret: secret.clone(),
        replaces: replaced.map(|(page, secret)| ReplacedPage {
            page: PageId(page),
            secret,
        }),
        states,
    };
    // On error the session has ended, which the writer notices.
    let _ = shared.access.orders.send(Order::Opened(opened)).await;
    let link = SharedLink::default();
    let (mut sink, mut stream) = socket.split();
    let (answers, waiting) = mpsc::channel(ANSWERS);
    let (views, chosen) = mpsc::channel(ANSWERS);
    let reader = Reader {
        page,
        shared: &shared,
        visitor: &visitor,
        link: &link,
        snapshots: snapshots.clone(),
        answers,
        views,
        frames: Bucket::default(),
        wrong_tokens: 0,
        refused: None,
    };
    let writer = Writer {
        page,
        secret,
        answer: introduction.answer,
        shared: &shared,
        visitor: &visitor,
        link: &link,
        snapshots,
        said: Arc::default(),
    };
    let parting = tokio::select! {
        parting = reader.run(&mut stream) => parting,
        () = writer.run(&mut sink, waiting, chosen) => None,
        parting = supervise(&shared, &visitor) => Some(parting),
    };
    // First of all, the vehicles that the page drives have lost their operator.
    let _ = shared.access.orders.send(Order::Gone(page)).await;
    if let Some((code, reason)) = parting {
        let frame = CloseFrame {
            code,
            reason: Utf8Bytes::from_static(reason),
        };
        let close = async {
            sink.send(Message::Close(Some(frame))).await?;
            // Closing a socket with unread frames resets the connection, and the page would not
            // receive the reason.
            while stream.next().await.transpose()?.is_some() {}
            Ok::<(), axum::Error>(())
        };
        // Best effort: the page may not be reading, or not answer.
        let _ = timeout(STUCK, close).await;
    }
    // Requests that are still being answered hold the visitor.
    visitor.settle(None);
}

/// Code and reason of the Close frame.
pub(super) type Parting = (u16, &'static str);

/// Waits until the visitor has to go: without the token in time, or at the end of the session.
pub(super) async fn supervise(shared: &Shared, visitor: &Visitor) -> Parting {
    if let Some(gate) = shared.admission.gate.users() {
        while gate.holds(visitor, false) {
            sleep(CHECK).await;
        }
        return (SESSION_ENDED, "the session has ended");
    }
    sleep(LOGIN).await;
    if visitor.may(UserRole::Observe) {
        return std::future::pending().await;
    }
    (close_code::POLICY, "no token within 60 s")
}

struct Reader<'s> {
    page: PageId,
    shared: &'s Shared,
    visitor: &'s Arc<Visitor>,
    link: &'s SharedLink,
    /// The state of the page's vehicle, as the session last knew it.
    snapshots: watch::Receiver<Snapshot>,
    answers: mpsc::Sender<Utf8Bytes>,
    /// The filter for the page's message view.
    views: mpsc::Sender<Option<Filter>>,
    frames: Bucket,
    wrong_tokens: u32,
    /// When a request without an id was last refused.
    refused: Option<Instant>,
}

impl Reader<'_> {
    async fn run(mut self, stream: &mut SplitStream<WebSocket>) -> Option<Parting> {
        while let Some(message) = stream.next().await {
            let message = match message {
                Ok(message) => message,
                Err(error) => {
                    tracing::debug!(page = self.page.0, %error, "connection broken");
                    // Usually an oversized frame. If the connection is broken, nobody receives the
                    // reason.
                    self.shared.counters.too_much.fetch_add(1, Relaxed);
                    return Some((close_code::SIZE, "frames are limited to 4096 octets"));
                }
            };
            if self.frames.take(now(), FRAMES, 1).is_err() {
                self.shared.counters.too_much.fetch_add(1, Relaxed);
                return Some((
                    close_code::POLICY,
                    "too many frames; the limit is 50 per second",
                ));
            }
            let parting = match message {
                Message::Text(text) => self.handle(&text).await,
                Message::Binary(_) => Some((close_code::UNSUPPORTED, "frames must be JSON text")),
                Message::Close(_) => return None,
                Message::Ping(_) | Message::Pong(_) => None,
            };
            if parting.is_some() {
                return parting;
            }
        }
        None
    }

    async fn handle(&mut self, text: &str) -> Option<Parting> {
        let now = now();
        let frame = match Frame::read(text) {
            Ok(frame) => frame,
            Err(error) => {
                self.refuse(None, &format!("not a request: {error}"));
                return None;
            }
        };
        if let Some(gate) = self.shared.admission.gate.users()
            && !gate.holds(self.visitor, true)
        {
            return Some((SESSION_ENDED, "the session has ended"));
        }
        match frame.said {
            Said::Received { seen } => {
                self.link.lock().handle_received(now, seen);
                self.link.confirmed.notify_one();
            }
            Said::Seen(seen) => {
                // A page that has not shown it learns nothing from a refusal.
                let _ = self.link.lock().handle_seen(now, seen);
                self.link.confirmed.notify_one();
            }
            Said::Token { token } => return self.show(frame.id, &token).await,
            Said::Active => {}
            Said::Messages { on, filter } => self.choose(frame.id, on, &filter).await,
            Said::Overlay { zones } => self.overlay(frame.id, frame.vehicle, zones),
            Said::OperatorRequest(
                request @ OperatorRequest::Drive {
                    forward,
                    turn,
                    hand_ms,
                    seen,
                },
            ) => {
                let hand = hand_ms.map_or(Duration::MAX, Duration::from_millis);
                self.drive(frame.id, request, (forward, turn, hand), seen)
                    .await;
            }
            Said::OperatorRequest(request) => {
                let known = (frame.press, frame.stops);
                self.request(frame.id, frame.vehicle, request, known).await;
            }
        }
        None
    }

    /// Handles a token from the page.
    async fn show(&mut self, id: Option<u64>, token: &str) -> Option<Parting> {
        let address = self.visitor.address;
        let Err(why) = self
            .shared
            .admit_later(self.visitor, token, &self.shared.places)
            .await
        else {
            self.say(id.map(|id| Answer::Done { id }).as_ref());
            return None;
        };
        self.wrong_tokens += 1;
        tracing::warn!(page = self.page.0, "{why}");
        let user = &self.visitor.user;
        self.shared.admission.trail.login(user, address, Some(&why));
        self.refuse(id, &why);
        (self.wrong_tokens >= WRONG_TOKENS).then_some((close_code::POLICY, "too many wrong tokens"))
    }

    /// Starts or ends the message view.
    async fn choose(&mut self, id: Option<u64>, on: bool, filter: &MessageFilter) {
        if !self.visitor.may(UserRole::Observe) {
            return self.refuse(id, "viewing requires the token too");
        }
        if on && self.shared.admission.node.is_none() {
            return self.refuse(id, "the node runs in another process: see its debug view");
        }
        let chosen = match on.then(|| view::filter(filter)).transpose() {
            Ok(chosen) => chosen,
            Err(error) => return self.refuse(id, &error.to_string()),
        };
        // On error the writer has ended, and the connection with it.
        let _ = self.views.send(chosen).await;
        self.say(id.map(|id| Answer::Done { id }).as_ref());
    }

    /// Answers what lies over the map, when the session has it: nothing that follows waits for that.
    fn overlay(&mut self, id: Option<u64>, vehicle: Option<u16>, zones: u32) {
        if !self.visitor.may(UserRole::Observe) {
            return self.refuse(id, "viewing requires the token too");
        }
        let Some(vehicle) = vehicle else {
            return self.refuse(id, "name a vehicle");
        };
        let (orders, answers) = (self.shared.access.orders.clone(), self.answers.clone());
        tokio::spawn(async move {
            let (reply, overlay) = oneshot::channel();
            let order = Order::Overlay {
                vehicle,
                zones,
                reply,
            };
            // On error the session has ended, and the reply end is dropped as well.
            let _ = orders.send(order).await;
            if let Ok(overlay) = overlay.await {
                let overlay = overlay.as_ref();
                say(&answers, &Answer::Overlay { id, overlay });
            }
        });
    }

    /// Judges the age of a setpoint, and passes it on. The session confirms it, so that the page
    /// sends the next one only then.
    async fn drive(
        &mut self,
        id: Option<u64>,
        request: OperatorRequest,
        (forward, turn, hand): (f64, f64, Duration),
        seen: Option<Seen>,
    ) {
        let now = now();
        let vehicle = self.snapshots.borrow().vehicle;
        let waited = match seen {
            Some(seen) => self.link.lock().handle_setpoint(now, seen, vehicle),
            None => Err(TooOld::Unseen),
        };
        self.link.confirmed.notify_one();
        let reply = self.recorded(id, vehicle, request);
        if let Err(why) = self.visitor.check(&request, &self.shared.admission) {
            return reply(Err(why));
        }
        let order = DriveOrder {
            page: self.page,
            vehicle,
            forward,
            turn,
            waited,
            at: now,
            hand,
            reply,
        };
        // On error the session has ended, which the writer notices.
        let _ = self.shared.access.orders.send(Order::Drive(order)).await;
    }

    async fn request(
        &mut self,
        id: Option<u64>,
        vehicle: Option<u16>,
        request: OperatorRequest,
        (press, count): (Option<Press>, Option<u64>),
    ) {
        let reply = self.recorded(id, vehicle, request);
        let may_drive = self.visitor.may(UserRole::Drive);
        if let Err(why) = self.visitor.check(&request, &self.shared.admission) {
            return reply(Err(why));
        }
        let access = &self.shared.access;
        // On error the session has ended, which the writer notices.
        if request.is_stop() {
            let target = match (request, vehicle) {
                (OperatorRequest::EmergencyAll { .. }, _) => StopTarget::All,
                (_, Some(vehicle)) => StopTarget::Vehicle(vehicle),
                (_, None) => StopTarget::OfPage(self.page),
            };
            let answers = self.answers.clone();
            let reply = StopReply {
                taken: Box::new(move |taken| {
                    if let Some((press, taken)) = press.zip(taken.ok()) {
                        let stops = taken.count;
                        say(&answers, &Answer::Stopped { press, stops });
                    }
                }),
                confirmed: Some(reply),
            };
            let user = Arc::clone(&self.visitor.user);
            let order = StopOrder {
                target,
                press,
                user,
                reply,
            };
            let _ = access.stops.send(order).await;
        } else {
            let order = Order::OperatorRequest {
                page: self.page,
                vehicle,
                request,
                known: press.map(|press| KnownStops { press, count }),
                may_drive,
                reply,
            };
            let _ = access.orders.send(order).await;
        }
    }

    /// The callback for the result of a request, which also records it and confirms setpoints.
    fn recorded(
        &mut self,
        id: Option<u64>,
        vehicle: Option<u16>,
        request: OperatorRequest,
    ) -> Reply {
        let reply = self.reply(id);
        let (visitor, trail) = (self.visitor.clone(), self.shared.admission.trail.clone());
        let answers = self.answers.clone();
        Box::new(move |result| {
            let is_drive = matches!(
                request,
                OperatorRequest::Drive { .. } | OperatorRequest::DriveEnd
            );
            if is_drive {
                say(&answers, &Answer::Ok);
            }
            let who = (&*visitor.user, visitor.address);
            trail.request(who, vehicle, &request, &result);
            reply(result);
        })
    }

    /// The callback that reports the result of a request to the page. Without an id, only refusals
    /// are reported, at a limited rate.
    fn reply(&mut self, id: Option<u64>) -> Reply {
        let answers = self.answers.clone();
        let now = now();
        let quiet = self.refused.is_some_and(|at| now < at + REFUSAL);
        if id.is_none() && !quiet {
            self.refused = Some(now);
        }
        Box::new(move |result| {
            let answer = match (&result, id) {
                (Ok(()), Some(id)) => Answer::Done { id },
                (Err(reason), _) if id.is_some() || !quiet => Answer::Refused { id, reason },
                _ => return,
            };
            say(&answers, &answer);
        })
    }

    fn refuse(&mut self, id: Option<u64>, reason: &str) {
        self.reply(id)(Err(reason.to_owned()));
    }

    fn say(&self, answer: Option<&Answer<'_>>) {
        if let Some(answer) = answer {
            say(&self.answers, answer);
        }
    }
}

/// Queues an answer for the page. Drops it if the queue is full.
fn say(answers: &mpsc::Sender<Utf8Bytes>, answer: &Answer<'_>) {
    let _ = answers.try_send(Utf8Bytes::from(&*json(answer)));
}

/// The next message of the view, if there is one.
async fn next_message(view: &mut Option<MessageView<'_>>) -> Option<Utf8Bytes> {
    match view {
        Some(view) => view.next().await,
        None => std::future::pending().await,
    }
}

/// Sends all data to the page until it stops accepting or the session has ended.
struct Writer<'s> {
    page: PageId,
    secret: Option<Token>,
    /// By it the page knows this station.
    answer: Option<Token>,
    shared: &'s Shared,
    visitor: &'s Visitor,
    link: &'s SharedLink,
    snapshots: watch::Receiver<Snapshot>,
    /// The state that the page has.
    said: Arc<Map<String, Value>>,
}

impl Writer<'_> {
    async fn run(
        mut self,
        sink: &mut SplitSink<WebSocket, Message>,
        mut answers: mpsc::Receiver<Utf8Bytes>,
        mut chosen: mpsc::Receiver<Option<Filter>>,
    ) {
        let mut view = None;
        let mut lists = self.shared.access.lists.clone();
        lists.mark_changed();
        let mut pings = interval(PING);
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut links = interval_at(tokio::time::Instant::now() + LINK, LINK);
        links.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut next = vec![self.hello()];
        loop {
            for message in next.drain(..) {
                match timeout(STUCK, sink.feed(message)).await {
                    Ok(Ok(())) => {}
                    Ok(Err(_)) | Err(_) => return,
                }
            }
            match timeout(STUCK, sink.flush()).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) | Err(_) => return,
            }
            // All that is not an answer waits until the link has carried the last state.
            let may_watch = self.visitor.may(UserRole::Observe);
            let (is_free, left) = {
                let (link, now) = (self.link.lock(), now());
                (link.may_send(now), link.left(now))
            };
            let may_send = may_watch && is_free;
            let message = tokio::select! {
                biased;
                answer = answers.recv() => match answer {
                    Some(json) => Some(Message::Text(json)),
                    None => return,
                },
                changed = self.snapshots.changed(), if may_send => match changed {
                    Ok(()) => self.state(),
                    Err(_) => return,
                },
                list = lists.next(), if may_send => match list {
                    Some(json) => Some(self.unconfirmed(text(&json))),
                    None => return,
                },
                _ = links.tick(), if may_send => Some(self.unconfirmed(self.links())),
                () = self.link.confirmed.notified(), if !may_send => None,
                () = sleep(left), if may_watch && !left.is_zero() => None,
                _ = pings.tick() => Some(Message::Ping(axum::body::Bytes::new())),
                Some(filter) = chosen.recv() => {
                    view = filter.zip(self.shared.admission.node.as_ref()).map(|(filter, node)| {
                        MessageView::new(node, &self.shared.dictionary, filter)
                    });
                    None
                }
                message = next_message(&mut view), if may_send => match message {
                    Some(json) => Some(self.unconfirmed(Message::Text(json))),
                    None => return,
                },
            };
            if message.is_some() {
                // Whatever it answers shows that it is there.
                pings.reset();
            }
            next.extend(message);
            // The page acknowledges each packet, perhaps over a link on which that takes time.
            next.extend(std::iter::from_fn(|| answers.try_recv().ok()).map(Message::Text));
            // What goes with a state costs the way back nothing.
            if may_send && !next.is_empty() {
                if links.tick().now_or_never().is_some() {
                    next.push(self.links());
                }
                if let Some(Some(list)) = lists.next().now_or_never() {
                    next.push(text(&list));
                }
            }
        }
    }

    /// Notes that a frame is sent which the page does not confirm.
    fn unconfirmed(&self, message: Message) -> Message {
        self.link.lock().handle_frame(now());
        message
    }

    fn hello(&self) -> Message {
        let admission = &self.shared.admission;
        text(&json(&Answer::Hello {
            version: VERSION,
            page: self.page.0,
            secret: self.secret.as_ref().map(Token::reveal),
            answer: self.answer.as_ref().map(Token::reveal),
            // Most pages have shown it with their first request.
            token_needed: admission.gate.token().is_some() && !self.visitor.may(UserRole::Drive),
            watch: admission.gate.lets_watch(),
            operator: admission.operator.to_string(),
            authority: admission.authority,
            base_map: admission.base_map.is_some(),
        }))
    }

    /// What has changed in the state of the page's vehicle; `None` before the first.
    fn state(&mut self) -> Option<Message> {
        let snapshot = self.snapshots.borrow_and_update().clone();
        if snapshot.fields.is_empty() {
            return None;
        }
        let mut link = self.link.lock();
        link.handle_sent(now(), snapshot.seq, snapshot.vehicle);
        drop(link);
        let changed = changes(&self.said, &snapshot.fields);
        self.said = Arc::clone(&snapshot.fields);
        Some(text(&json(&Answer::State(&changed))))
    }

    fn links(&self) -> Message {
        let vehicle = self.snapshots.borrow().link;
        text(&json(&Answer::Link {
            page: self.link.lock().quality(now()),
            vehicle_round_trip_ms: vehicle.round_trip_ms,
            vehicle_loss_percent: vehicle.loss_percent,
        }))
    }
}

fn text(json: &str) -> Message {
    Message::Text(Utf8Bytes::from(json))
}
