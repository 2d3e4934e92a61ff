//! The part of a component's task that serves subscriptions and control: it forwards notifications
//! from the stack to their handles.

use std::collections::HashMap;
use std::sync::Arc;

use tokio::sync::{mpsc, oneshot, watch};

use super::feed::{Feed, Reader};
use crate::address::JausId;
use crate::node;
use crate::node::now;
use crate::service::{
    Audience, CannotSubscribe, ControlId, ControlLost, ControlNews, ControlRefused, Patience,
    SessionId, SessionOrder, SessionSettings, SessionState, Stack, SubscriptionEnd, SubscriptionId,
    SubscriptionNews, Topic,
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
        settings: SessionSettings,
        reply: oneshot::Sender<Begun>,
    },
}

/// What a handle wants of its subscription, control or session. Sent without waiting.
#[derive(Debug, Clone, Copy)]
pub(super) enum Instruction {
    EndSubscription(SubscriptionId),
    EndControl(ControlId),
    EndSession(SessionId),
    Session(SessionId, SessionOrder),
}

/// Sends the end of its subscription, control or session when it is dropped, on any thread.
#[derive(Debug)]
pub(super) struct Ticket {
    end: Instruction,
    /// Only the application fills this queue. It is emptied before everything else.
    instructions: mpsc::UnboundedSender<Instruction>,
}

impl Ticket {
    /// Sends an instruction. False if the component has stopped.
    pub(super) fn instruct(&self, instruction: Instruction) -> bool {
        self.instructions.send(instruction).is_ok()
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        // Without the component it has ended already.
        self.instruct(self.end);
    }
}

/// A new session.
pub(super) struct Begun {
    pub(super) id: SessionId,
    pub(super) ticket: Ticket,
    pub(super) state: watch::Receiver<SessionState>,
}

/// The result of a request for a subscription.
pub(super) type Subscribed = Result<(Ticket, Reader), NotSubscribed>;

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
    instructions: mpsc::UnboundedSender<Instruction>,
    subscribing: HashMap<SubscriptionId, oneshot::Sender<Subscribed>>,
    feeds: HashMap<SubscriptionId, Arc<Feed>>,
    asking: HashMap<ControlId, oneshot::Sender<Controlled>>,
    controls: HashMap<ControlId, watch::Sender<Condition>>,
    sessions: HashMap<SessionId, watch::Sender<SessionState>>,
}

impl Clients {
    /// `instructions` is the channel whose entries the task passes to [`follow`](Self::follow).
    pub(super) fn new(instructions: mpsc::UnboundedSender<Instruction>) -> Self {
        Self {
            instructions,
            subscribing: HashMap::new(),
            feeds: HashMap::new(),
            asking: HashMap::new(),
            controls: HashMap::new(),
            sessions: HashMap::new(),
        }
    }

    fn ticket(&self, end: Instruction) -> Ticket {
        Ticket {
            end,
            instructions: self.instructions.clone(),
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
                settings,
                reply,
            } => {
                let now = now();
                let id = stack.begin_session(now, audience, settings, patience);
                let (state, states) = watch::channel(SessionState::Seeking);
                self.sessions.insert(id, state);
                let ticket = self.ticket(Instruction::EndSession(id));
                let begun = Begun {
                    id,
                    ticket,
                    state: states,
                };
                // An unclaimed ticket cancels.
                drop(reply.send(begun));
            }
        }
    }

    pub(super) fn follow(&mut self, stack: &mut Stack, instruction: Instruction) {
        let now = now();
        match instruction {
            Instruction::EndSubscription(id) => {
                self.feeds.remove(&id);
                stack.unsubscribe(now, id);
            }
            Instruction::EndControl(id) => stack.release_control(now, id),
            Instruction::EndSession(id) => stack.release_session(now, id),
            Instruction::Session(id, order) => stack.order_session(now, id, order),
        }
    }

    pub(super) fn tell_subscriber(&mut self, id: SubscriptionId, news: SubscriptionNews) {
        if let Some(reply) = self.subscribing.remove(&id) {
            if let SubscriptionNews::Ended(end) = news {
                let _ = reply.send(Err(NotSubscribed::Ended(end)));
                return;
            }
            let (feed, reader) = Reader::new();
            self.feeds.insert(id, feed);
            // An unclaimed ticket cancels.
            let _ = reply.send(Ok((self.ticket(Instruction::EndSubscription(id)), reader)));
        }
        if let Some(feed) = self.feeds.get(&id) {
            feed.tell(now(), news);
        }
    }

    pub(super) fn tell_controller(&mut self, id: ControlId, news: ControlNews) {
        match news {
            ControlNews::Granted => {
                let Some(reply) = self.asking.remove(&id) else {
                    return;
                };
                let (condition, conditions) = watch::channel(Condition::Held(None));
                self.controls.insert(id, condition);
                let _ = reply.send(Ok((self.ticket(Instruction::EndControl(id)), conditions)));
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
        if let Some(states) = self.sessions.get(&id) {
            states.send_replace(state);
        }
        if state == SessionState::Released {
            self.sessions.remove(&id);
        }
    }

    /// Cancels requests whose callers are gone.
    pub(super) fn cancel_abandoned(&mut self, stack: &mut Stack) {
        self.subscribing.retain(|&id, reply| {
            if reply.is_closed() {
                stack.unsubscribe(now(), id);
            }
            !reply.is_closed()
        });
        self.asking.retain(|&id, reply| {
            if reply.is_closed() {
                stack.release_control(now(), id);
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
    let now = now();
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
    let now = now();
    let id = stack
        .request_control(now, peer, authority, patience)
        .map_err(NotControlled::Refused)?;
    transmit(stack).map_err(|error| {
        stack.release_control(now, id);
        NotControlled::NotSent(error)
    })?;
    Ok(id)
}
