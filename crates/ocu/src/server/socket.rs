//! The WebSocket of one page: requests to the session, snapshots and answers back. Reading and
//! writing are independent, so that a page that reads slowly can still stop the vehicle.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

use super::Shared;
use super::bounds::{Bucket, FRAMES};
use super::view::{self, MessageView};
use super::visitor::Visitor;
use crate::answer::Said as Answer;
use crate::request::{Frame, MessageFilter, OperatorRequest, Said};
use crate::session::{Order, Reply};
use crate::stick::PageId;
use crate::users::UserRole;
use jaus_view::Filter;

/// Version of the protocol between page and station.
const VERSION: u32 = 2;
/// Limit of queued answers per page. Further answers are dropped.
const ANSWERS: usize = 64;
/// A page that accepts no data for this time is disconnected.
const STUCK: Duration = Duration::from_secs(5);
/// Ping interval. Browsers answer pings automatically.
const PING: Duration = Duration::from_secs(5);
/// Delay of the reply to a wrong token.
const WRONG_TOKEN: Duration = Duration::from_secs(1);
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

/// Serves a page until either side closes the connection.
pub(super) async fn serve(socket: WebSocket, shared: Arc<Shared>, visitor: Visitor) {
    let page = PageId(shared.pages.fetch_add(1, Relaxed));
    let visitor = Arc::new(visitor);
    let (mut sink, mut stream) = socket.split();
    let (answers, waiting) = mpsc::channel(ANSWERS);
    let (views, chosen) = mpsc::channel(ANSWERS);
    let reader = Reader {
        page,
        shared: &shared,
        visitor: &visitor,
        answers,
        views,
        frames: Bucket::new(Instant::now()),
        wrong_tokens: 0,
        refused: None,
    };
    let parting = tokio::select! {
        parting = reader.run(&mut stream) => parting,
        () = write(&mut sink, &shared, &visitor, waiting, chosen) => None,
        parting = supervise(&shared, &visitor) => Some(parting),
    };
    // Release the stick first, since the page that may hold it is gone.
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
}

/// Code and reason of the Close frame.
type Parting = (u16, &'static str);

/// Waits until the visitor has to go: without the token in time, or at the end of the session.
async fn supervise(shared: &Shared, visitor: &Visitor) -> Parting {
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
            if self.frames.take(Instant::now(), FRAMES).is_err() {
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
        let frame: Frame = match serde_json::from_str(text) {
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
            Said::Token { token } => return self.show(frame.id, &token).await,
            Said::Active => {}
            Said::Messages { on, filter } => self.choose(frame.id, on, &filter).await,
            Said::OperatorRequest(request) => {
                self.request(frame.id, frame.vehicle, request).await;
            }
        }
        None
    }

    /// Handles a token from the page.
    async fn show(&mut self, id: Option<u64>, token: &str) -> Option<Parting> {
        let address = self.visitor.address;
        let Err(why) = self.shared.admits(token, address) else {
            if self.shared.admission.gate.token().is_some() {
                self.visitor.trust();
                let user = &self.visitor.user;
                self.shared.admission.trail.login(user, address, None);
            }
            self.say(id.map(|id| Answer::Done { id }).as_ref());
            return None;
        };
        self.wrong_tokens += 1;
        tracing::warn!(page = self.page.0, "{why}");
        let user = &self.visitor.user;
        self.shared.admission.trail.login(user, address, Some(why));
        sleep(WRONG_TOKEN).await;
        self.refuse(id, why);
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

    async fn request(&mut self, id: Option<u64>, vehicle: Option<u16>, request: OperatorRequest) {
        let reply = self.reply(id);
        let (visitor, trail) = (self.visitor.clone(), self.shared.admission.trail.clone());
        let reply: Reply = Box::new(move |result| {
            trail.request(&visitor, vehicle, &request, &result);
            reply(result);
        });
        if !self.visitor.may(UserRole::Drive) {
            return reply(Err(self.why_not()));
        }
        let order = Order::OperatorRequest {
            page: self.page,
            user: self.visitor.user.clone(),
            vehicle,
            request,
            reply,
        };
        // On error the session has ended, which the writer notices.
        let _ = self.shared.access.orders.send(order).await;
    }

    /// Why the visitor may not change anything.
    fn why_not(&self) -> String {
        if self.shared.admission.gate.users().is_none() {
            return "this requires the token that jaus-ocu printed or read from its file"
                .to_owned();
        }
        format!(
            "this requires the role drive; {} may only observe",
            self.visitor.user
        )
    }

    /// The callback that reports the result of a request to the page. Without an id, only refusals
    /// are reported, at a limited rate.
    fn reply(&mut self, id: Option<u64>) -> Reply {
        let answers = self.answers.clone();
        let now = Instant::now();
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
    // Serialisation cannot fail for numbers and text.
    if let Ok(json) = serde_json::to_string(answer) {
        let _ = answers.try_send(json.into());
    }
}

/// The next message of the view, if there is one.
async fn next_message(view: &mut Option<MessageView<'_>>) -> Option<Utf8Bytes> {
    match view {
        Some(view) => view.next().await,
        None => std::future::pending().await,
    }
}

/// Sends all data to the page until it stops accepting or the session has ended.
async fn write(
    sink: &mut SplitSink<WebSocket, Message>,
    shared: &Shared,
    visitor: &Visitor,
    mut answers: mpsc::Receiver<Utf8Bytes>,
    mut chosen: mpsc::Receiver<Option<Filter>>,
) {
    let mut view = None;
    let mut snapshots = shared.access.snapshots.clone();
    snapshots.mark_changed();
    let mut pings = interval(PING);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let hello = Answer::Hello {
        version: VERSION,
        token_needed: shared.admission.gate.token().is_some(),
        operator: shared.admission.operator.to_string(),
        authority: shared.admission.authority,
        base_map: shared.admission.base_map.is_some(),
    };
    let mut next = serde_json::to_string(&hello)
        .ok()
        .map(|it| Message::Text(it.into()));
    loop {
        if let Some(message) = next.take() {
            match timeout(STUCK, sink.send(message)).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) | Err(_) => return,
            }
        }
        next = tokio::select! {
            biased;
            answer = answers.recv() => match answer {
                Some(json) => Some(Message::Text(json)),
                None => return,
            },
            snapshot = snapshots.next(), if visitor.may(UserRole::Observe) => match snapshot {
                Some(json) => Some(Message::Text(Utf8Bytes::from(&*json))),
                None => return,
            },
            _ = pings.tick() => Some(Message::Ping(axum::body::Bytes::new())),
            Some(filter) = chosen.recv() => {
                view = filter.zip(shared.admission.node.as_ref()).map(|(filter, node)| {
                    MessageView::new(node, &shared.dictionary, filter)
                });
                None
            }
            message = next_message(&mut view) => match message {
                Some(json) => Some(Message::Text(json)),
                None => return,
            },
        };
    }
}
