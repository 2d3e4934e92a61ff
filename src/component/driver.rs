//! The task of a component: it gives the services messages and the time, and carries out what
//! they want.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use tokio::sync::{mpsc, oneshot, watch};

use super::clients::{Clients, Goodbye, Hold};
use super::watch::Outlet;
use crate::address::JausId;
use crate::endpoint::Received;
use crate::node::{self, Port};
use crate::service::{
    Change, Condition, Directory, Event, Inquiry, NoAnswer, Patience, Service, Stack, Standing,
};

/// What the application wants of its component.
pub(super) enum Command {
    /// To have a question answered.
    Ask {
        peer: JausId,
        query: Bytes,
        report: u16,
        reply: oneshot::Sender<Answer>,
    },
    /// To have something that lasts.
    Hold(Hold),
    /// To offer one more service.
    Offer(Box<dyn Service>),
    /// To offer one less.
    Withdraw(&'static str),
    /// To show how the component is.
    Condition(Condition),
    /// To tell subscribers that the answer to the query with this code is another.
    Announce(u16),
    /// To tell that a command with this code has ended, well or not.
    End(u16, bool),
}

/// What has become of a question.
#[derive(Debug)]
pub(super) enum Answer {
    Report(Bytes),
    None(NoAnswer),
    NotSent(node::SendError),
}

/// What the application may read and listen to.
pub(super) struct Publisher {
    pub(super) directory: watch::Sender<Arc<Directory>>,
    pub(super) standing: watch::Sender<Standing>,
    pub(super) changes: Arc<Outlet<Change>>,
    pub(super) messages: Arc<Outlet<Received>>,
}

impl Drop for Publisher {
    fn drop(&mut self) {
        self.changes.end();
        self.messages.end();
    }
}

pub(super) struct Driver {
    stack: Stack,
    port: Port,
    inbox: mpsc::Receiver<Command>,
    publisher: Publisher,
    patience: Patience,
    waiting: HashMap<Inquiry, oneshot::Sender<Answer>>,
    clients: Clients,
    goodbyes: mpsc::UnboundedReceiver<Goodbye>,
}

impl Driver {
    pub(super) fn new(
        stack: Stack,
        port: Port,
        inbox: mpsc::Receiver<Command>,
        publisher: Publisher,
        patience: Patience,
    ) -> Self {
        let (bid, goodbyes) = mpsc::unbounded_channel();
        Self {
            stack,
            port,
            inbox,
            publisher,
            patience,
            waiting: HashMap::new(),
            clients: Clients::new(bid),
            goodbyes,
        }
    }

    /// Runs until the node has stopped or nobody holds the component any more.
    pub(super) async fn run(mut self) {
        self.stack.start(Instant::now());
        self.settle();
        loop {
            let wake = self.stack.poll_timeout();
            tokio::select! {
                received = self.port.recv() => match received {
                    Some(message) => self.stack.handle_message(Instant::now(), &message),
                    None => return,
                },
                command = self.inbox.recv() => match command {
                    Some(command) => self.obey(command),
                    None => return self.take_leave(),
                },
                Some(goodbye) = self.goodbyes.recv() => {
                    self.clients.part(&mut self.stack, goodbye);
                }
                () = sleep_until(wake) => self.stack.handle_timeout(Instant::now()),
            }
            self.settle();
        }
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Ask {
                peer,
                query,
                report,
                reply,
            } => {
                let now = Instant::now();
                let inquiry = self.stack.ask(now, peer, query, report, self.patience);
                match self.transmit() {
                    Ok(()) => {
                        self.waiting.insert(inquiry, reply);
                    }
                    Err(error) => {
                        self.stack.cancel(now, inquiry);
                        // Whoever asked may have gone away.
                        let _ = reply.send(Answer::NotSent(error));
                    }
                }
            }
            Command::Hold(hold) => self.hold(hold),
            Command::Offer(service) => self.stack.offer(Instant::now(), service),
            Command::Withdraw(urn) => {
                self.stack.withdraw(Instant::now(), urn);
            }
            Command::Condition(condition) => self.stack.set_condition(Instant::now(), condition),
            Command::End(command, successful) => {
                self.stack.end_command(Instant::now(), command, successful);
            }
            Command::Announce(query) => self.stack.announce(Instant::now(), query),
        }
    }

    /// Gives back what others keep for this component.
    fn take_leave(&mut self) {
        self.stack.take_leave(Instant::now());
        self.settle();
    }

    /// Carries out whatever the services want.
    fn settle(&mut self) {
        if let Err(error) = self.transmit() {
            tracing::debug!(id = %self.stack.id(), %error, "message not sent");
        }
        let mut changed = false;
        while let Some(event) = self.stack.poll_event() {
            match event {
                Event::Change(change) => {
                    if !changed {
                        changed = true;
                        self.publisher.directory.send_replace(self.snapshot());
                    }
                    self.publisher.changes.send(change);
                }
                Event::Answer(inquiry, answer) => {
                    let answer = answer.map_or_else(Answer::None, Answer::Report);
                    if let Some(reply) = self.waiting.remove(&inquiry) {
                        // Whoever asked may have gone away.
                        let _ = reply.send(answer);
                    }
                }
                Event::Subscription(id, news) => self.clients.tell_subscriber(id, news),
                Event::Control(id, news) => self.clients.tell_controller(id, news),
                Event::Standing(standing) => _ = self.publisher.standing.send_replace(standing),
                Event::Message(message) => self.publisher.messages.send(message),
            }
        }
        self.forget_the_impatient();
    }

    fn snapshot(&self) -> Arc<Directory> {
        Arc::new(self.stack.directory().clone())
    }

    fn hold(&mut self, hold: Hold) {
        let Self {
            stack,
            port,
            clients,
            patience,
            ..
        } = self;
        clients.obey(stack, hold, *patience, |stack| transmit(stack, port));
    }

    fn transmit(&mut self) -> Result<(), node::SendError> {
        transmit(&mut self.stack, &self.port)
    }

    /// Gives up the questions whose askers have gone away.
    fn forget_the_impatient(&mut self) {
        let stack = &mut self.stack;
        self.waiting.retain(|&inquiry, reply| {
            if reply.is_closed() {
                stack.cancel(Instant::now(), inquiry);
            }
            !reply.is_closed()
        });
        self.clients.forget_the_impatient(stack);
    }
}

/// Sends everything; tells the first error.
fn transmit(stack: &mut Stack, port: &Port) -> Result<(), node::SendError> {
    let mut result = Ok(());
    while let Some(message) = stack.poll_transmit() {
        let sent = port.send(message).map(|_| ());
        result = result.and(sent);
    }
    result
}

pub(super) async fn sleep_until(wake: Option<Instant>) {
    match wake {
        Some(wake) => tokio::time::sleep_until(wake.into()).await,
        None => std::future::pending().await,
    }
}
