//! The task of a component: passes messages and the time to the services, and executes their
//! output. However it ends, the services stop what they move.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::JoinSet;

use super::StopReason;
use super::clients::{Clients, Hold, Instruction};
use super::directories::Membership;
use super::latest::LatestSender;
use super::watch::Outlet;
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Outgoing, Received};
use crate::messages::core::QueryHeartbeatPulse;
use crate::node::{self, Port, Resident, now, sleep_until};
use crate::service::{
    Change, Condition, Event, Inquiry, NoAnswer, NotPublished, Patience, Publication, QueryOptions,
    Question, Service, Stack, Standing, State, UnsafeService,
};

/// A request of the application to its component's task. What is large is boxed, because every
/// place in the queue has room for the largest command.
pub(super) enum Command {
    /// Send a query and wait for the answer.
    Ask(Box<Ask>),
    /// Create a subscription or request control.
    Hold(Box<Hold>),
    /// Add a service.
    Offer(Box<dyn Service>, oneshot::Sender<Result<(), UnsafeService>>),
    /// Withdraw a service.
    Withdraw(&'static str),
    /// Set the reported condition of the component.
    Condition(Condition),
    /// Publish a report.
    Publish(Publication, oneshot::Sender<Result<(), NotPublished>>),
    /// Notify subscribers that the answer to the query with this code has changed.
    Announce(u16),
    /// Report the end of the command with this code, and whether it was successful.
    End(u16, bool),
}

/// A query, and where its result goes.
pub(super) struct Ask {
    pub(super) peer: JausId,
    pub(super) question: Question,
    pub(super) options: QueryOptions,
    pub(super) reply: oneshot::Sender<Answer>,
}

/// The result of a query.
#[derive(Debug)]
pub(super) enum Answer {
    Report(Bytes),
    None(NoAnswer),
    NotSent(node::SendError),
}

/// What the application can read and watch.
pub(super) struct Publisher {
    /// Wakes tasks that wait for a change of the directory.
    pub(super) directory: watch::Sender<()>,
    pub(super) standing: watch::Sender<Standing>,
    pub(super) stop: watch::Sender<Option<StopReason>>,
    pub(super) refused_setpoints: Arc<AtomicU64>,
    pub(super) changes: Arc<Outlet<Change>>,
    pub(super) messages: Arc<Outlet<Received>>,
}

impl Drop for Publisher {
    /// Also runs when a service panics.
    fn drop(&mut self) {
        let (reason, state) = match std::thread::panicking() {
            true => (StopReason::Panicked, State::Failure),
            false => (StopReason::Ended, State::Shutdown),
        };
        self.standing.send_modify(|standing| {
            standing.state = state;
            standing.controller = None;
        });
        self.stop.send_replace(Some(reason));
        self.changes.end();
        self.messages.end();
    }
}

pub(super) struct Driver {
    stack: Stack,
    /// Dropped after the stack.
    membership: Membership,
    port: Port,
    resident: Resident,
    latest: LatestSender,
    probes: Probes,
    inbox: mpsc::Receiver<Command>,
    publisher: Publisher,
    patience: Patience,
    waiting: HashMap<Inquiry, oneshot::Sender<Answer>>,
    clients: Clients,
    instructions: mpsc::UnboundedReceiver<Instruction>,
}

impl Driver {
    pub(super) fn new(
        stack: Stack,
        membership: Membership,
        (port, latest): (Port, LatestSender),
        inbox: mpsc::Receiver<Command>,
        publisher: Publisher,
        patience: Patience,
    ) -> Self {
        let (instruct, instructions) = mpsc::unbounded_channel();
        Self {
            stack,
            membership,
            resident: port.reside(),
            port,
            latest,
            probes: Probes::default(),
            inbox,
            publisher,
            patience,
            waiting: HashMap::new(),
            clients: Clients::new(instruct),
            instructions,
        }
    }

    /// How long a component that ends waits for the release of control.
    const LEAVE: Duration = Duration::from_millis(900);

    /// Runs until the node stops or the last handle of the component is dropped.
    pub(super) async fn run(mut self) {
        self.stack.start(now());
        self.settle();
        loop {
            let wake = self.stack.poll_timeout();
            tokio::select! {
                received = self.port.recv() => match received {
                    Some(message) => self.stack.handle_message(now(), &message),
                    None => return,
                },
                command = self.inbox.recv() => match command {
                    Some(command) => {
                        self.follow();
                        self.obey(command);
                    }
                    None => return self.leave().await,
                },
                () = self.resident.closing() => return self.leave().await,
                Some(instruction) = self.instructions.recv() => {
                    self.clients.follow(&mut self.stack, instruction);
                }
                Some((peer, delivered)) = self.probes.next() => {
                    if delivered {
                        self.stack.handle_acknowledged(now(), peer);
                    }
                }
                () = self.membership.changed() => self.stack.handle_directory(now()),
                () = sleep_until(wake) => {
                    self.note_progress();
                    self.stack.handle_timeout(now());
                }
            }
            self.settle();
        }
    }

    /// Postpones the repetition of queries to peers that are sending a large message.
    fn note_progress(&mut self) {
        let now = now();
        let overdue: BTreeSet<_> = self.stack.overdue(now).collect();
        for peer in overdue {
            if let Some(latest) = self.port.last_fragment(peer) {
                self.stack.handle_progress(now, peer, latest);
            }
        }
    }

    /// Follows the instructions that were sent before a command, so that the command finds ended
    /// what was dropped.
    fn follow(&mut self) {
        while let Ok(instruction) = self.instructions.try_recv() {
            self.clients.follow(&mut self.stack, instruction);
        }
    }

    /// Stops what the services move, ends subscriptions and control of peers, and waits a moment
    /// for the confirmations.
    async fn leave(&mut self) {
        let end = now() + Self::LEAVE;
        self.stack.take_leave(now());
        self.settle();
        while self.stack.is_releasing() {
            let wake = self.stack.poll_timeout().map_or(end, |wake| wake.min(end));
            tokio::select! {
                received = self.port.recv() => match received {
                    Some(message) => self.stack.handle_message(now(), &message),
                    None => return,
                },
                () = sleep_until(Some(wake)) => self.stack.handle_timeout(now()),
            }
            if now() >= end {
                return;
            }
            self.settle();
        }
    }

    fn ask(&mut self, ask: Ask) {
        let Ask {
            peer,
            question,
            mut options,
            reply,
        } = ask;
        let now = now();
        options.patience.get_or_insert(self.patience);
        let inquiry = self.stack.ask(now, peer, question, options);
        match self.transmit() {
            Ok(()) => {
                self.waiting.insert(inquiry, reply);
            }
            Err(error) => {
                self.stack.cancel(now, inquiry);
                // The caller may have gone.
                let _ = reply.send(Answer::NotSent(error));
            }
        }
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Ask(ask) => self.ask(*ask),
            Command::Hold(hold) => self.hold(*hold),
            Command::Offer(service, reply) => {
                // The application may not wait for it.
                let _ = reply.send(self.stack.offer(now(), service));
            }
            Command::Withdraw(urn) => {
                self.stack.withdraw(now(), urn);
            }
            Command::Condition(condition) => self.stack.set_condition(now(), condition),
            Command::End(command, successful) => {
                self.stack.end_command(now(), command, successful);
            }
            Command::Publish(publication, reply) => {
                // As above.
                let _ = reply.send(self.stack.publish(now(), &publication));
            }
            Command::Announce(query) => self.stack.announce(now(), query),
        }
    }

    /// Executes the output of the services.
    fn settle(&mut self) {
        if let Err(error) = self.transmit() {
            tracing::debug!(id = %self.stack.id(), %error, "cannot send the message");
        }
        let mut changed = false;
        while let Some(event) = self.stack.poll_event() {
            match event {
                Event::Change(change) => {
                    if !changed {
                        changed = true;
                        self.publisher.directory.send_replace(());
                    }
                    self.publisher.changes.send(change);
                }
                Event::Answer(inquiry, answer) => {
                    let answer = answer.map_or_else(Answer::None, Answer::Report);
                    if let Some(reply) = self.waiting.remove(&inquiry) {
                        // The caller may have gone.
                        let _ = reply.send(answer);
                    }
                }
                Event::Subscription(id, news) => self.clients.tell_subscriber(id, news),
                Event::Control(id, news) => self.clients.tell_controller(id, news),
                Event::Session(id, state) => self.clients.tell_session(id, state),
                Event::Standing(standing) => _ = self.publisher.standing.send_replace(standing),
                Event::Message(message) => self.publisher.messages.send(message),
            }
        }
        let refused = self.stack.refused_setpoints();
        self.publisher.refused_setpoints.store(refused, Relaxed);
        self.membership.publish();
        self.cancel_abandoned();
    }

    fn hold(&mut self, hold: Hold) {
        let Self {
            stack,
            port,
            latest,
            clients,
            patience,
            probes,
            ..
        } = self;
        clients.obey(stack, hold, *patience, |stack| {
            transmit(stack, (port, latest), probes)
        });
    }

    fn transmit(&mut self) -> Result<(), node::SendError> {
        let ways = (&self.port, &self.latest);
        transmit(&mut self.stack, ways, &mut self.probes)
    }

    /// Cancels queries whose callers have gone.
    fn cancel_abandoned(&mut self) {
        let stack = &mut self.stack;
        self.waiting.retain(|&inquiry, reply| {
            if reply.is_closed() {
                stack.cancel(now(), inquiry);
            }
            !reply.is_closed()
        });
        self.clients.cancel_abandoned(stack);
    }
}

/// Probes that wait for an acknowledgement: one per peer at a time, so that a silent peer does not
/// fill its window.
#[derive(Default)]
struct Probes {
    tasks: JoinSet<(JausId, bool)>,
    peers: BTreeSet<JausId>,
}

impl Probes {
    /// Limit of peers: more than a component probes within the lifetime of a probe.
    const MOST: usize = 512;

    /// Sends a probe and waits for its acknowledgement, or sends it without one.
    fn send(&mut self, port: &Port, mut probe: Outgoing) -> Result<(), node::SendError> {
        let peer = probe.destination;
        if self.peers.len() >= Self::MOST || !self.peers.insert(peer) {
            probe.acknowledge = false;
            return port.send(probe).map(drop);
        }
        let sender = port.sender();
        self.tasks.spawn(async move {
            let delivered = sender.deliver(probe).await;
            (peer, delivered.is_ok())
        });
        Ok(())
    }

    /// The next peer whose probe has ended, and whether it was acknowledged; `None` while there is
    /// none.
    async fn next(&mut self) -> Option<(JausId, bool)> {
        let (peer, delivered) = self.tasks.join_next().await?.ok()?;
        self.peers.remove(&peer);
        Some((peer, delivered))
    }
}

/// Sends all queued messages; returns the first error.
fn transmit(
    stack: &mut Stack,
    (port, latest): (&Port, &LatestSender),
    probes: &mut Probes,
) -> Result<(), node::SendError> {
    let mut result = Ok(());
    while let Some(message) = stack.poll_transmit() {
        // An acknowledged probe is a sign of life.
        let is_probe = message
            .payload
            .starts_with(&QueryHeartbeatPulse::CODE.to_le_bytes());
        let sent = match message.acknowledge && is_probe {
            true => probes.send(port, message),
            false => latest.send(message).map(drop),
        };
        result = result.and(sent);
    }
    result
}
