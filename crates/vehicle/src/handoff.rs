//! Handing over control on request: Enhanced Access Control of the interoperability profiles.
//!
//! A client that cannot take control, because another one has it with an equal or higher authority,
//! requests it here. The component passes the request on to the client in control, which grants or
//! refuses it. A grant hands control over without a gap in which a third client could take it; the
//! component stops, and stands by until the new client resumes it.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::{Message, ServiceId};
use jaus::endpoint::Received;
use jaus::service::{Context, Controller, Handled, Service, Share, Standing, State, code_of};
use jaus_limits::last_of_crowd;

use crate::messages::handoff::confirm_handoff_request::ResponseCode as Answer;
use crate::messages::handoff::confirm_release_control::ResponseCode as Decision;
use crate::messages::handoff::request_release_control::RequestReleaseControlRec;
use crate::messages::handoff::{
    ConfirmHandoffRequest, ConfirmReleaseControl, QueryEnhancedTimeout, QueryHandoffTimeout,
    RemoveHandoffRequest, ReportEnhancedTimeout, ReportHandoffTimeout, RequestHandoff,
    RequestReleaseControl, enhanced_access_control,
};

/// Enhanced Access Control of a component.
#[derive(Debug, Default)]
pub struct Handoff {
    requests: Vec<Request>,
    last_id: u8,
    /// When the client in control was last notified of the requests.
    notified: Option<Instant>,
}

/// A request for control that is not decided yet.
#[derive(Debug)]
struct Request {
    id: u8,
    client: JausId,
    origin: Share,
    content: RequestHandoff,
    since: Instant,
    renewed: Instant,
}

impl Request {
    const fn as_controller(&self) -> Controller {
        Controller {
            id: self.client,
            authority: self.content.authority_code,
        }
    }

    fn expires(&self) -> Instant {
        let lapse = self.renewed + seconds(Handoff::LAPSE);
        lapse.min(self.since + seconds(Handoff::ANSWER))
    }
}

impl Handoff {
    /// Time that the client in control has to decide about a request, in seconds.
    pub const ANSWER: u8 = 30;
    /// A request that its client does not repeat lapses after this time, in seconds.
    pub const LAPSE: u8 = 5;
    /// Limit of undecided requests. Further ones are refused, or displace one of an origin that has more than its
    /// share.
    const MOST: usize = 8;
    /// The client in control is told of the requests at this interval, because a message may be
    /// lost.
    const REPEAT: Duration = Duration::from_secs(1);

    /// Without requests.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Handles a new or repeated request.
    fn request(
        &mut self,
        now: Instant,
        (client, origin): (JausId, Share),
        content: RequestHandoff,
        context: &mut Context<'_>,
    ) {
        let Standing {
            state,
            controller,
            least_authority,
            ..
        } = *context.standing();
        let known = self.requests.iter().position(|it| it.client == client);
        let id = match known {
            Some(at) => self.requests[at].id,
            None => self.next_id(),
        };
        let request = Request {
            id,
            client,
            origin,
            content,
            since: known.map_or(now, |at| self.requests[at].since),
            renewed: now,
        };
        let answer = if !matches!(state, State::Ready | State::Standby) {
            Answer::NOT_AVAILABLE
        } else if request.content.authority_code < least_authority.max(1) {
            Answer::INSUFFICIENT_AUTHORITY
        } else if controller.is_none_or(|it| it.id == client) {
            context.hand_over(request.as_controller());
            Answer::GRANTED
        } else if let Some(at) = known {
            self.requests[at] = request;
            Answer::QUEUED
        } else if self.has_place_for(&request, context) {
            tracing::info!(id = %context.id(), %client, "control is requested");
            self.requests.push(request);
            self.notify_controller(now, context);
            Answer::QUEUED
        } else {
            Answer::NOT_AVAILABLE
        };
        if answer != Answer::QUEUED {
            self.requests.retain(|it| it.client != client);
        }
        confirm(client, id, answer, context);
    }

    /// Whether there is a place for a request. In a full list another one gives way, of the origin, or else of the
    /// subsystem, that has most of them: one origin may use many ids, and one key may have many sessions.
    fn has_place_for(&mut self, newcomer: &Request, context: &mut Context<'_>) -> bool {
        if self.requests.len() < Self::MOST {
            return true;
        }
        let origin = |it: &Request| it.origin;
        let subsystem = |it: &Request| it.client.subsystem();
        let crowding = last_of_crowd(&self.requests, &origin(newcomer), origin)
            .or_else(|| last_of_crowd(&self.requests, &subsystem(newcomer), subsystem));
        let Some(at) = crowding else {
            return false;
        };
        let displaced = self.requests.remove(at);
        let answer = Answer::NOT_AVAILABLE;
        confirm(displaced.client, displaced.id, answer, context);
        true
    }

    /// A number that no undecided request has.
    fn next_id(&mut self) -> u8 {
        loop {
            self.last_id = self.last_id.wrapping_add(1);
            if self.requests.iter().all(|it| it.id != self.last_id) {
                return self.last_id;
            }
        }
    }

    /// Handles the withdrawal of a request.
    fn remove(&mut self, now: Instant, client: JausId, id: u8, context: &mut Context<'_>) {
        self.requests.retain(|it| it.client != client);
        confirm(client, id, Answer::DENIED, context);
        self.notify_controller(now, context);
    }

    /// Handles the decisions of the client in control.
    fn decide(
        &mut self,
        now: Instant,
        by: JausId,
        decisions: &ConfirmReleaseControl,
        context: &mut Context<'_>,
    ) {
        if context.standing().controller.is_none_or(|it| it.id != by) {
            return;
        }
        for decision in &decisions.release_control_list {
            let mut requests = self.requests.iter();
            let Some(at) = requests.position(|it| it.id == decision.id) else {
                continue;
            };
            match decision.response_code {
                Decision::GRANTED => return self.grant(at, context),
                Decision::WAIT => {
                    self.requests[at].since = now;
                    let request = &self.requests[at];
                    confirm(request.client, request.id, Answer::DEFERRED, context);
                }
                _ => {
                    let denied = self.requests.remove(at);
                    confirm(denied.client, denied.id, Answer::DENIED, context);
                }
            }
        }
        self.notify_controller(now, context);
    }

    /// Hands control over, and refuses the other requests.
    fn grant(&mut self, at: usize, context: &mut Context<'_>) {
        let granted = self.requests.remove(at);
        context.hand_over(granted.as_controller());
        confirm(granted.client, granted.id, Answer::GRANTED, context);
        for other in self.requests.drain(..) {
            confirm(other.client, other.id, Answer::DENIED, context);
        }
    }

    /// Notifies the client in control of the requests. An empty list clears its display.
    fn notify_controller(&mut self, now: Instant, context: &mut Context<'_>) {
        self.notified = Some(now);
        let Some(controller) = context.standing().controller else {
            return;
        };
        let requests = self.requests.iter().map(|it| RequestReleaseControlRec {
            id: it.id,
            src_subsystem_id: it.client.subsystem(),
            src_node_id: it.client.node(),
            src_component_id: it.client.component(),
            authority_code: it.content.authority_code,
            explanation: it.content.explanation.clone(),
        });
        let message = RequestReleaseControl {
            request_release_control_list: requests.collect(),
        };
        context.send(controller.id, &message);
    }
}

impl Service for Handoff {
    fn offers(&self) -> Vec<ServiceId> {
        vec![enhanced_access_control::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let (from, octets) = (message.source, &message.payload);
        match code_of(octets) {
            Some(RequestHandoff::CODE) => {
                if let Ok(content) = RequestHandoff::decode(octets) {
                    self.request(now, (from, Share::of(message)), content, context);
                }
            }
            Some(RemoveHandoffRequest::CODE) => {
                if let Ok(removed) = RemoveHandoffRequest::decode(octets) {
                    self.remove(now, from, removed.id, context);
                }
            }
            Some(ConfirmReleaseControl::CODE) => {
                if let Ok(decisions) = ConfirmReleaseControl::decode(octets) {
                    self.decide(now, from, &decisions, context);
                }
            }
            Some(QueryHandoffTimeout::CODE) => {
                let timeout = Self::ANSWER;
                context.reply(message, &ReportHandoffTimeout { timeout });
            }
            Some(QueryEnhancedTimeout::CODE) => {
                let timeout = Self::LAPSE;
                context.reply(message, &ReportEnhancedTimeout { timeout });
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    /// Ends requests that lapse or stay without an answer, and repeats the others.
    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let before = self.requests.len();
        for ended in self.requests.extract_if(.., |it| it.expires() <= now) {
            confirm(ended.client, ended.id, Answer::TIMEOUT, context);
        }
        let left = self.requests.len();
        let is_due = self
            .notified
            .is_none_or(|notified| now >= notified + Self::REPEAT);
        if left < before || (left > 0 && is_due) {
            self.notify_controller(now, context);
        }
    }

    /// The first of the waiting clients gets control that is released.
    fn handle_standing(&mut self, now: Instant, _before: &Standing, context: &mut Context<'_>) {
        let Standing {
            state, controller, ..
        } = *context.standing();
        self.requests
            .retain(|it| controller.is_none_or(|holder| holder.id != it.client));
        if self.requests.is_empty() || !matches!(state, State::Ready | State::Standby) {
            return;
        }
        match controller {
            Some(_) => self.notify_controller(now, context),
            None => self.grant(0, context),
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = self.requests.iter().map(Request::expires).min()?;
        let repeat = self.notified.map(|notified| notified + Self::REPEAT);
        Some(repeat.map_or(next, |repeat| repeat.min(next)))
    }
}

const fn seconds(seconds: u8) -> Duration {
    Duration::from_secs(seconds as u64)
}

fn confirm(client: JausId, id: u8, response_code: Answer, context: &mut Context<'_>) {
    context.send(client, &ConfirmHandoffRequest { id, response_code });
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests;
