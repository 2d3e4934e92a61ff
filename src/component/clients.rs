//! The part of a component's task that serves subscriptions and control: it forwards notifications
//! from the stack to their handles.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::{mpsc, oneshot, watch};

use super::feed::Feed;
use crate::address::JausId;
use crate::node;
use crate::service::{
    Audience, CannotSubscribe, ControlId, ControlLost, ControlNews, ControlRefused, Patience,
    Retake, SessionId, SessionState, Stack, SubscriptionEnd, SubscriptionId, SubscriptionNews,
    Topic,
};

/// A request for a subscription, for control, or for a session.
pub(super) enum Hold {
    /// A subscription to reports.
    Subscribe {
        topic: Topic,
        reply: oneshot::Sender<Subscribed>,
    },
    /// Control over a peer.
    Control {
        peer: JausId,
        authority: u8,
        reply: oneshot::Sender<Controlled>,
    },
    /// A session.
    Session {
        audience: Audience,
        authority: u8,
        retake: Retake,
        reply: oneshot::Sender<Begun>,
    },
}

/// The end of a subscription, of control, or of a session.
#[derive(Debug, Clone, Copy)]
pub(super) enum Cancellation {
    Subscription(SubscriptionId),
    Control(ControlId),
    Session(SessionId),
}

/// Sends the cancellation when it is dropped, on any thread.
#[derive(Debug)]
pub(super) struct Ticket {
    cancellation: Cancellation,
    /// The queue cannot outgrow the limits of subscriptions and control, because each ticket sends
    /// once.
    cancellations: mpsc::UnboundedSender<Cancellation>,
}

impl Drop for Ticket {
    fn drop(&mut self) {
        // An error means that the component has stopped, so it has ended already.
        let _ = self.cancellations.send(self.cancellation);
    }
}

/// A new session.
pub(super) struct Begun {
    pub(super) id: SessionId,
    pub(super) ticket: Ticket,
    pub(super) state: watch::Receiver<SessionState>,
}

/// The result of a request for a subscription.
pub(super) type Subscribed = Result<(Ticket, Arc<Feed>), NotSubscribed>;

/// Why there is no subscription.
pub(super) enum NotSubscribed {
    Impossible(CannotSubscribe),
    Ended(SubscriptionEnd),
    NotSent(node::SendError),
}

/// The result of a request for control.
pub(super) type Controlled = Result<(Ticket, watch::Receiver<Condition>), NotControlled>;

/// Why there is no control.
pub(super) enum NotControlled {
    Refused(ControlRefused),
    NotSent(node::SendError),
}

/// The state of control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Condition {
    /// The peer has granted it. Contains the last reported status.
    Held(Option<u8>),
    Lost(ControlLost),
    /// The peer has confirmed the release, or will never answer.
    Released,
}

/// All active and pending subscriptions and control leases.
pub(super) struct Clients {
    cancellations: mpsc::UnboundedSender<Cancellation>,
    subscribing: HashMap<SubscriptionId, oneshot::Sender<Subscribed>>,
    feeds: HashMap<SubscriptionId, Arc<Feed>>,
    asking: HashMap<ControlId, oneshot::Sender<Controlled>>,
    controls: HashMap<ControlId, watch::Sender<Condition>>,
    sessions: HashMap<SessionId, watch::Sender<SessionState>>,
}

impl Clients {
    /// `cancellations` is the channel whose entries the task passes to [`part`](Self::part).
    pub(super) fn new(cancellations: mpsc::UnboundedSender<Cancellation>) -> Self {
        Self {
            cancellations,
            subscribing: HashMap::new(),
            feeds: HashMap::new(),
            asking: HashMap::new(),
            controls: HashMap::new(),
            sessions: HashMap::new(),
        }
    }

    fn ticket(&self, cancellation: Cancellation) -> Ticket {
        Ticket {
            cancellation,
            cancellations: self.cancellations.clone(),
        }
    }

    /// Starts a request. `transmit` sends the resulting messages of the stack.
    pub(super) fn obey(
        &mut self,
        stack: &mut Stack,
        hold: Hold,
        patience: Patience,
        transmit: impl FnOnce(&mut Stack) -> Result<(), node::SendError>,
    ) {
        // A failed reply is ignored: the caller may be gone.
        match hold {
            Hold::Subscribe { topic, reply } => {
                match begin_subscription(stack, &topic, patience, transmit) {
                    Ok(id) => drop(self.subscribing.insert(id, reply)),
                    Err(error) => drop(reply.send(Err(error))),
                }
            }
            Hold::Control {
                peer,
                authority,
                reply,
            } => match begin_control(stack, peer, authority, patience, transmit) {
                Ok(id) => drop(self.asking.insert(id, reply)),
                Err(error) => drop(reply.send(Err(error))),
            },
            Hold::Session {
                audience,
                authority,
                retake,
                reply,
            } => {
                let now = Instant::now();
                let id = stack.begin_session(now, audience, authority, retake, patience);
                let (state, told) = watch::channel(SessionState::Engaging);
                self.sessions.insert(id, state);
                let ticket = self.ticket(Cancellation::Session(id));
                let begun = Begun {
                    id,
                    ticket,
                    state: told,
                };
                // An unclaimed ticket cancels.
                drop(reply.send(begun));
            }
        }
    }

    pub(super) fn part(&mut self, stack: &mut Stack, cancellation: Cancellation) {
        match cancellation {
            Cancellation::Subscription(id) => {
                self.feeds.remove(&id);
                stack.unsubscribe(Instant::now(), id);
            }
            Cancellation::Control(id) => stack.release_control(Instant::now(), id),
            Cancellation::Session(id) => stack.release_session(Instant::now(), id),
        }
    }

    pub(super) fn tell_subscriber(&mut self, id: SubscriptionId, news: SubscriptionNews) {
        if let Some(reply) = self.subscribing.remove(&id) {
            if let SubscriptionNews::Ended(end) = news {
                let _ = reply.send(Err(NotSubscribed::Ended(end)));
                return;
            }
            let feed = Arc::new(Feed::new());
            self.feeds.insert(id, feed.clone());
            // An unclaimed ticket cancels.
            let _ = reply.send(Ok((self.ticket(Cancellation::Subscription(id)), feed)));
        }
        if let Some(feed) = self.feeds.get(&id) {
            feed.tell(news);
        }
    }

    pub(super) fn tell_controller(&mut self, id: ControlId, news: ControlNews) {
        match news {
            ControlNews::Granted => {
                let Some(reply) = self.asking.remove(&id) else {
                    return;
                };
                let (condition, told) = watch::channel(Condition::Held(None));
                self.controls.insert(id, condition);
                let _ = reply.send(Ok((self.ticket(Cancellation::Control(id)), told)));
            }
            ControlNews::Refused(why) => {
                if let Some(reply) = self.asking.remove(&id) {
                    let _ = reply.send(Err(NotControlled::Refused(why)));
                }
            }
            ControlNews::Status(status) => {
                if let Some(condition) = self.controls.get(&id) {
                    condition.send_replace(Condition::Held(Some(status)));
                }
            }
            ControlNews::Lost(why) => {
                if let Some(condition) = self.controls.get(&id) {
                    condition.send_replace(Condition::Lost(why));
                }
            }
            ControlNews::Released => {
                if let Some(condition) = self.controls.remove(&id) {
                    condition.send_replace(Condition::Released);
                }
            }
        }
    }

    pub(super) fn tell_session(&mut self, id: SessionId, state: SessionState) {
        if let Some(told) = self.sessions.get(&id) {
            told.send_replace(state);
        }
        if state == SessionState::Released {
            self.sessions.remove(&id);
        }
    }

    /// Cancels requests whose callers are gone.
    pub(super) fn cancel_abandoned(&mut self, stack: &mut Stack) {
        self.subscribing.retain(|&id, reply| {
            if reply.is_closed() {
                stack.unsubscribe(Instant::now(), id);
            }
            !reply.is_closed()
        });
        self.asking.retain(|&id, reply| {
            if reply.is_closed() {
                stack.release_control(Instant::now(), id);
            }
            !reply.is_closed()
        });
    }
}

impl Drop for Clients {
    fn drop(&mut self) {
        for feed in self.feeds.values() {
            feed.stop();
        }
    }
}

fn begin_subscription(
    stack: &mut Stack,
    topic: &Topic,
    patience: Patience,
    transmit: impl FnOnce(&mut Stack) -> Result<(), node::SendError>,
) -> Result<SubscriptionId, NotSubscribed> {
    let now = Instant::now();
    let id = stack
        .subscribe(now, topic, patience)
        .map_err(NotSubscribed::Impossible)?;
    transmit(stack).map_err(|error| {
        stack.unsubscribe(now, id);
        NotSubscribed::NotSent(error)
    })?;
    Ok(id)
}

fn begin_control(
    stack: &mut Stack,
    peer: JausId,
    authority: u8,
    patience: Patience,
    transmit: impl FnOnce(&mut Stack) -> Result<(), node::SendError>,
) -> Result<ControlId, NotControlled> {
    let now = Instant::now();
    let id = stack
        .request_control(now, peer, authority, patience)
        .map_err(NotControlled::Refused)?;
    transmit(stack).map_err(|error| {
        stack.release_control(now, id);
        NotControlled::NotSent(error)
    })?;
    Ok(id)
}
