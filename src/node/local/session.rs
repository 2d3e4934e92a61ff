//! One component of another process: what it says goes to the endpoint, what is in its mailbox goes
//! to it.
//!
//! Both happen in one poll, without a queue in between: the socket is read where the endpoint is
//! called, and written where the mailbox is read. A component that does not read fills the socket;
//! then its mailbox fills, and drops by [its rule](crate::node::MailboxLimits). Its requests are
//! not read either while the answers to them do not fit, so that nothing here grows with what it
//! does.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::Sleep;

use super::super::attendance::{ComponentEvent, Departure};
use super::super::awaiting::Waiter;
use super::super::core::{Core, LAST_WORDS, Shared};
use super::super::mailbox::Mailbox;
use super::super::replies::Replies;
use crate::address::JausId;
use crate::endpoint::{Outgoing, Received};
use crate::link::local::record::{Delivery, RecordError, Reply, Request, Send};
use crate::link::local::{Body, Connection, Error, Outbox, Process, WriteHalf};

/// Octets collected for one write.
const FULL: usize = 64 << 10;
/// Reads in one turn, before other tasks have theirs.
const TURN: usize = 4;
/// How long a component may read nothing before that is news.
const STUCK: Duration = Duration::from_secs(2);

/// An attached component.
#[derive(Debug)]
pub(super) struct Session {
    shared: Arc<Shared>,
    connection: Connection,
    write: WriteHalf,
    outbox: Outbox,
    id: JausId,
    process: Process,
    mailbox: Arc<Mailbox>,
    replies: Arc<Replies>,
    stuck: Stuck,
}

/// Whether the component reads.
#[derive(Debug, Default)]
struct Stuck {
    timer: Option<Pin<Box<Sleep>>>,
    /// What waited when the timer was started.
    waiting: usize,
    said: bool,
}

impl Session {
    pub(super) fn new(
        shared: Arc<Shared>,
        connection: Connection,
        write: WriteHalf,
        id: JausId,
        process: Process,
        mailbox: Arc<Mailbox>,
    ) -> Self {
        Self {
            shared,
            connection,
            write,
            outbox: Outbox::default(),
            id,
            process,
            mailbox,
            replies: Arc::default(),
            stuck: Stuck::default(),
        }
    }

    /// Says something first.
    pub(super) fn with(mut self, reply: &Reply) -> Self {
        self.outbox.reply(reply);
        self
    }

    /// Serves the component until it is gone or the node has stopped.
    pub(super) async fn run(mut self) {
        let shared = self.shared.clone();
        let end = async {
            let mut stopped = shared.stopped.subscribe();
            // An error would mean that the node is gone, and that is what is waited for.
            let _ = stopped.wait_for(|stopped| *stopped).await;
            tokio::time::sleep(LAST_WORDS).await;
        };
        let why = tokio::select! {
            biased;
            why = std::future::poll_fn(|cx| self.poll(cx)) => why,
            () = end => Departure::Stopped,
        };
        self.depart(why);
    }

    fn depart(&self, why: Departure) {
        self.shared.lock().detach(self.id, &self.mailbox, why);
    }

    fn poll(&mut self, cx: &mut Context<'_>) -> Poll<Departure> {
        for _ in 0..TURN {
            match self.poll_write(cx) {
                Poll::Ready(Err(error)) => return Poll::Ready(Departure::from(&error)),
                Poll::Ready(Ok(())) => return Poll::Ready(Departure::Stopped),
                Poll::Pending => {}
            }
            match self.poll_read(cx) {
                Poll::Ready(Ok(false)) => {}
                Poll::Ready(Ok(true)) => return Poll::Ready(Departure::Left),
                Poll::Ready(Err(error)) => return Poll::Ready(Departure::from(&error)),
                Poll::Pending => return Poll::Pending,
            }
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }

    /// Writes what waits. Ready when the node has stopped and all is written.
    fn poll_write(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Error>> {
        loop {
            let mut closed = false;
            if self.outbox.len() < FULL {
                self.replies.drain(cx, &mut self.outbox);
                let outbox = &mut self.outbox;
                let each = |message| {
                    outbox.reply(&Reply::Deliver(delivery(message)));
                    outbox.len() < FULL
                };
                closed = self.mailbox.poll_drain(cx, each).is_ready();
            }
            if self.outbox.is_empty() {
                self.handle_progress();
                return if closed {
                    Poll::Ready(Ok(()))
                } else {
                    Poll::Pending
                };
            }
            match self.outbox.poll_flush(&mut self.write, cx) {
                Poll::Ready(Ok(())) => {}
                Poll::Ready(Err(error)) => {
                    return Poll::Ready(Err(Error::io("writing to a component")(error)));
                }
                Poll::Pending => {
                    self.watch(cx);
                    return Poll::Pending;
                }
            }
        }
    }

    /// Reads once. Ready with `true` when the component leaves.
    fn poll_read(&mut self, cx: &mut Context<'_>) -> Poll<Result<bool, Error>> {
        if self.replies.is_full() {
            // Then the outbox is full too, and when that has room there is another turn.
            return Poll::Pending;
        }
        let (mut left, mut core) = (false, None);
        let (shared, id, replies) = (&self.shared, self.id, &self.replies);
        let each = |body: Body<'_>| {
            match Request::decode(&body)? {
                Request::Send(send) => {
                    let core = core.get_or_insert_with(|| shared.lock());
                    transmit(core, id, send, replies);
                }
                Request::Leave => left = true,
                Request::Hello(_) => return Err(RecordError::Stranger),
            }
            Ok(())
        };
        self.connection.poll_read(cx, each).map_ok(|()| left)
    }

    /// The component takes nothing just now: it is watched.
    fn watch(&mut self, cx: &mut Context<'_>) {
        let waiting = self.outbox.len();
        if self.stuck.timer.is_none() || self.stuck.waiting != waiting {
            self.handle_progress();
            self.stuck.waiting = waiting;
            self.stuck.timer = Some(Box::pin(tokio::time::sleep(STUCK)));
        }
        let Some(timer) = &mut self.stuck.timer else {
            return;
        };
        if !self.stuck.said && timer.as_mut().poll(cx).is_ready() {
            self.stuck.said = true;
            let (id, process) = (self.id, self.process.clone());
            tracing::warn!(%id, %process, "component reads nothing; its messages will be dropped");
            let event = ComponentEvent::Stuck { id, process };
            self.shared.lock().attendance.announce(event);
        }
    }

    /// The component reads, or there is nothing for it to read.
    fn handle_progress(&mut self) {
        self.stuck.timer = None;
        if std::mem::take(&mut self.stuck.said) {
            let (id, dropped) = (self.id, self.mailbox.counters().dropped);
            tracing::info!(%id, dropped, "component reads again");
            let event = ComponentEvent::Resumed { id, dropped };
            self.shared.lock().attendance.announce(event);
        }
    }
}

impl Drop for Session {
    /// Also when the runtime ends under it.
    fn drop(&mut self) {
        self.depart(Departure::Stopped);
    }
}

/// Sends a component's message; what is wrong with it is told to the component.
fn transmit(core: &mut Core, source: JausId, send: Send, replies: &Arc<Replies>) {
    let handle = send.handle;
    let waiter = send.acknowledge.then(|| Waiter::There {
        replies: replies.clone(),
        handle,
    });
    let message = Outgoing {
        source,
        destination: send.destination,
        priority: send.priority,
        broadcast: send.broadcast,
        acknowledge: send.acknowledge,
        payload: send.payload,
    };
    if let Err(error) = core.send(message, waiter) {
        let words = error.to_string();
        replies.push(Reply::Rejected { handle, words });
    }
}

fn delivery(message: Received) -> Delivery {
    Delivery {
        source: message.source,
        destination: message.destination,
        priority: message.priority,
        broadcast: message.broadcast,
        path: message.path,
        payload: message.payload,
    }
}
