//! The WebSockets that carry nothing but stops, so that these wait for no other frame. The right to
//! observe suffices.
//!
//! A page sends `stop SUBSYSTEM PRESS` or `stop-all PRESS`, and repeats it until the vehicles have
//! confirmed the emergency. The [press](crate::press), which may be left out, tells copies from new
//! stops. The answer is `ok SUBSYSTEM PRESS COUNT` or `ok all PRESS COUNT` when the emergency has been
//! sent, `cleared SUBSYSTEM PRESS` if this press was cleared since, or `no REASON`. The count is that of
//! all stops that the station has taken with this one: a state that names a lower one was made before.
//! Where reading requires the token, `token TOKEN` comes first. The first frame of the station is the answer to the
//! page's nonce if it named one, and else empty; then comes an empty one every 10 s.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::SinkExt;
use jaus_limits::Bucket;
use tokio::sync::mpsc;
use tokio::time::{Instant, Interval, MissedTickBehavior, interval_at, timeout};

use super::Shared;
use super::bounds::FRAMES;
use super::introduction::Introduction;
use super::socket::{Parting, supervise};
use super::visitor::Visitor;
use crate::orders::{StopOrder, StopReply, StopTarget, TakenStop};
use crate::press::Press;
use crate::request::OperatorRequest;
use crate::users::UserRole;
use jaus::node::now;

/// Interval of empty frames, by which the page knows that the connection works, each with a ping, whose answer
/// keeps the connection from being idle. They share a packet: the browser acknowledges each, and repeats that
/// several times on a way back that has become slow.
const PULSE: Duration = Duration::from_secs(10);
/// A page that accepts no data for this time is disconnected.
const STUCK: Duration = Duration::from_secs(5);
/// Largest frame, except that with the token.
const LARGEST: usize = 32;
/// Limit of queued answers. Further answers are dropped.
const ANSWERS: usize = 8;

/// Serves a connection until either side closes it.
pub(super) async fn serve(
    mut socket: WebSocket,
    shared: Arc<Shared>,
    visitor: Visitor,
    introduction: Introduction,
) {
    let answer = introduction.answer.as_ref();
    let first = answer.map_or_else(Utf8Bytes::default, |it| it.reveal().into());
    let parting = tokio::select! {
        parting = Stops::new(&shared, &visitor).run(&mut socket, first) => parting,
        parting = supervise(&shared, &visitor) => Some(parting),
    };
    if let Some((code, reason)) = parting {
        let reason = Utf8Bytes::from_static(reason);
        let close = socket.send(Message::Close(Some(CloseFrame { code, reason })));
        // Best effort: the page may not be reading.
        let _ = timeout(STUCK, close).await;
    }
}

struct Stops<'s> {
    shared: &'s Shared,
    visitor: &'s Visitor,
    frames: Bucket,
    answers: mpsc::Sender<String>,
    waiting: mpsc::Receiver<String>,
}

impl<'s> Stops<'s> {
    fn new(shared: &'s Shared, visitor: &'s Visitor) -> Self {
        let (answers, waiting) = mpsc::channel(ANSWERS);
        Self {
            shared,
            visitor,
            frames: Bucket::default(),
            answers,
            waiting,
        }
    }

    async fn run(mut self, socket: &mut WebSocket, first: Utf8Bytes) -> Option<Parting> {
        let mut pulses = self.pulses();
        let mut next = Some(Message::Text(first));
        loop {
            if let Some(message) = next.take() {
                timeout(STUCK, socket.send(message)).await.ok()?.ok()?;
            }
            next = tokio::select! {
                biased;
                frame = socket.recv() => {
                    if let Some(parting) = self.handle(frame?.ok()?).await {
                        return Some(parting);
                    }
                    None
                }
                Some(answer) = self.waiting.recv() => Some(Message::Text(answer.into())),
                _ = pulses.tick() => {
                    let ping = socket.feed(Message::Ping(axum::body::Bytes::new()));
                    timeout(STUCK, ping).await.ok()?.ok()?;
                    Some(Message::Text(Utf8Bytes::from_static("")))
                }
            };
        }
    }

    /// The times of the empty frames after the first. A page opens two connections, which take turns.
    fn pulses(&self) -> Interval {
        let is_even = self
            .shared
            .stop_connections
            .fetch_add(1, Relaxed)
            .is_multiple_of(2);
        let first = if is_even { PULSE } else { PULSE / 2 };
        let mut pulses = interval_at(Instant::now() + first, PULSE);
        pulses.set_missed_tick_behavior(MissedTickBehavior::Delay);
        pulses
    }

    async fn handle(&mut self, message: Message) -> Option<Parting> {
        if self.frames.take(now(), FRAMES, 1).is_err() {
            self.shared.counters.too_much.fetch_add(1, Relaxed);
            return Some((close_code::POLICY, "too many frames"));
        }
        match message {
            Message::Text(text) => match text.strip_prefix("token ") {
                Some(token) => self.show(token).await,
                None => self.stop(&text).await,
            },
            Message::Binary(_) => Some((close_code::UNSUPPORTED, "frames must be text")),
            Message::Close(_) => Some((close_code::NORMAL, "")),
            Message::Ping(_) | Message::Pong(_) => None,
        }
    }

    /// Handles a token. A wrong one ends the connection.
    async fn show(&self, token: &str) -> Option<Parting> {
        let places = &self.shared.stop_places;
        match self.shared.admit_later(self.visitor, token, places).await {
            Ok(()) => None,
            Err(_) => Some((close_code::POLICY, "wrong token")),
        }
    }

    async fn stop(&self, text: &str) -> Option<Parting> {
        let Some((vehicle, press)) = read(text) else {
            return Some((close_code::POLICY, "stop SUBSYSTEM or stop-all"));
        };
        if let Some(gate) = self.shared.admission.gate.users()
            && !gate.holds(self.visitor, true)
        {
            return Some((close_code::POLICY, "the session has ended"));
        }
        if !self.visitor.may(UserRole::Observe) {
            self.answer("no stopping requires the right to observe".to_owned());
            return None;
        }
        let order = StopOrder {
            target: vehicle.map_or(StopTarget::All, StopTarget::Vehicle),
            press,
            user: Arc::clone(&self.visitor.user),
            reply: self.reply(vehicle, press),
        };
        // On error the session has ended, and the connection with it.
        let _ = self.shared.access.stops.send(order).await;
        None
    }

    /// The callback that answers and records a stop. A repetition is not recorded.
    fn reply(&self, vehicle: Option<u16>, press: Option<Press>) -> StopReply {
        let answers = self.answers.clone();
        let trail = self.shared.admission.trail.clone();
        let (user, address) = (self.visitor.user.clone(), self.visitor.address);
        let taken = move |result: Result<TakenStop, &str>| {
            let request = match vehicle {
                Some(_) => OperatorRequest::Emergency { on: true },
                None => OperatorRequest::EmergencyAll { on: true },
            };
            let answer = match result {
                Ok(taken) => in_words(vehicle, press, taken.count),
                Err(why) => format!("no {why}"),
            };
            if result.map_or(true, |it| it.is_new) {
                let result = result.map(|_| ()).map_err(str::to_owned);
                trail.request((&user, address), vehicle, &request, &result);
            }
            // A full queue means that the page has not read the answers before.
            let _ = answers.try_send(answer);
        };
        StopReply {
            taken: Box::new(taken),
            confirmed: None,
        }
    }

    fn answer(&self, answer: String) {
        let _ = self.answers.try_send(answer);
    }
}

/// The answer to a stop of a vehicle, or of all, with its press and the number of stops, unless it was cleared.
fn in_words(vehicle: Option<u16>, press: Option<Press>, count: Option<u64>) -> String {
    let target = vehicle.map_or_else(|| "all".to_owned(), |it| it.to_string());
    match (press, count) {
        (Some(press), Some(count)) => format!("ok {target} {press} {count}"),
        (Some(press), None) => format!("cleared {target} {press}"),
        (None, _) => format!("ok {target}"),
    }
}

/// The vehicle of a stop, `None` for all, and the press.
fn read(text: &str) -> Option<(Option<u16>, Option<Press>)> {
    if text.len() > LARGEST {
        return None;
    }
    let mut words = text.split(' ');
    let vehicle = match words.next()? {
        "stop" => Some(words.next()?.parse().ok()?),
        "stop-all" => None,
        _ => return None,
    };
    // With a press that cannot be read it is still a stop.
    let press = words.next().and_then(|it| it.parse().ok());
    Some((vehicle, press))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_names_a_vehicle_or_all_and_perhaps_a_press() {
        assert_eq!(read("stop 101"), Some((Some(101), None)));
        assert_eq!(read("stop-all"), Some((None, None)));
        let press = "4294967295.4294967295".parse().ok();
        assert!(press.is_some());
        let longest = "stop 65535 4294967295.4294967295";
        assert_eq!(read(longest), Some((Some(65_535), press)));
        assert_eq!(read("stop-all 4294967295.4294967295"), Some((None, press)));
        assert_eq!(read("stop 1 2"), Some((Some(1), None)));
        assert_eq!(read("stop 1 x 3"), Some((Some(1), None)));
        for wrong in ["", "stop", "stop x", "stop 65536", "go 1"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
