//! The task of a line: it reads what the node says, writes what senders have left, and reaches the
//! node again when it is lost.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::Sleep;

use super::line::{HostEvent, Line};
use super::{Attached, Host};
use crate::endpoint::Received;
use crate::link::local::record::{RecordError, Reply};
use crate::link::local::{Connection, Error};
use crate::node::HostError;

/// Reads in one turn, before other tasks have theirs.
const TURN: usize = 4;
/// Messages that one read may bring at most, nearly: before it, so many must fit.
const ROOM: usize = 1024;
/// How long a component that reads nothing holds up what comes behind, such as the outcomes of
/// what it has sent.
const PATIENCE: Duration = Duration::from_millis(100);
/// How long a node may take to read that a component leaves.
const FAREWELL: Duration = Duration::from_secs(1);
/// The pauses between two attempts to reach the node again, the first and the longest.
const PAUSES: (Duration, Duration) = (Duration::from_millis(10), Duration::from_secs(1));

#[derive(Debug)]
pub(super) struct Task {
    host: Host,
    line: Arc<Line>,
    connection: Connection,
    pause: Pause,
}

/// Why a connection has ended.
enum End {
    Left,
    Lost(Error),
}

impl Task {
    pub(super) fn new(host: Host, attached: Attached) -> Self {
        let line = Arc::new(Line::new(attached.welcome.id, host.limits));
        let connection = take_up(&line, attached);
        Self {
            host,
            line,
            connection,
            pause: Pause::default(),
        }
    }

    pub(super) fn line(&self) -> Arc<Line> {
        self.line.clone()
    }

    pub(super) async fn run(mut self) {
        let line = self.line.clone();
        loop {
            let farewell = async {
                line.left().await;
                tokio::time::sleep(FAREWELL).await;
            };
            let end = tokio::select! {
                biased;
                end = std::future::poll_fn(|cx| self.poll(cx)) => end,
                () = farewell => End::Left,
            };
            let End::Lost(error) = end else {
                return line.handle_left();
            };
            tracing::warn!(id = %line.id(), %error, "the node of this host is lost");
            line.handle_lost(error.to_string());
            tokio::select! {
                () = self.reach() => {}
                () = line.left() => return,
            }
        }
    }

    /// Tries until the node, or its successor, has the component again.
    async fn reach(&mut self) {
        let mut pause = PAUSES.0;
        let mut refused = None;
        loop {
            tokio::time::sleep(pause).await;
            pause = (2 * pause).min(PAUSES.1);
            match self.host.greet_again(self.line.id()).await {
                Ok(attached) => {
                    self.connection = take_up(&self.line, attached);
                    tracing::info!(id = %self.line.id(), "the node of this host is back");
                    self.line.announce(HostEvent::Back);
                    return;
                }
                Err(HostError::Refused { words, .. }) => {
                    if refused.as_ref() != Some(&words) {
                        tracing::warn!(id = %self.line.id(), why = words, "not taken back");
                        let why = words.clone();
                        self.line.announce(HostEvent::Refused { why });
                        refused = Some(words);
                    }
                }
                Err(error) => tracing::debug!(%error, "no node yet"),
            }
        }
    }

    fn poll(&mut self, cx: &mut Context<'_>) -> Poll<End> {
        for _ in 0..TURN {
            match self.poll_write(cx) {
                Poll::Ready(Ok(())) => return Poll::Ready(End::Left),
                Poll::Ready(Err(error)) => return Poll::Ready(End::Lost(error)),
                Poll::Pending => {}
            }
            if self.pause.poll(&self.line, cx).is_pending() {
                return Poll::Pending;
            }
            let line = &*self.line;
            match self
                .connection
                .poll_read(cx, |body| handle(line, Reply::decode(&body)?))
            {
                Poll::Ready(Ok(())) => {}
                Poll::Ready(Err(error)) => return Poll::Ready(End::Lost(error)),
                Poll::Pending => return Poll::Pending,
            }
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    }

    /// Writes what waits. Ready when the component has left and all is written.
    fn poll_write(&self, cx: &mut Context<'_>) -> Poll<Result<(), Error>> {
        let mut inner = self.line.lock();
        let inner = &mut *inner;
        match &inner.task {
            Some(task) if task.will_wake(cx.waker()) => {}
            _ => inner.task = Some(cx.waker().clone()),
        }
        let Some(write) = &mut inner.write else {
            return Poll::Ready(Err(Error::Closed));
        };
        let flushed = inner.outbox.poll_flush(write, cx);
        inner.full = flushed.is_pending();
        inner.direct = !inner.full;
        match flushed {
            Poll::Ready(Ok(())) if inner.left => Poll::Ready(Ok(())),
            Poll::Ready(Ok(())) => {
                self.line.emptied.notify_waiters();
                Poll::Pending
            }
            Poll::Ready(Err(error)) => Poll::Ready(Err(Error::io("writing to the node")(error))),
            Poll::Pending => Poll::Pending,
        }
    }
}

/// Begins with a connection.
fn take_up(line: &Line, attached: Attached) -> Connection {
    let max_message = attached.welcome.max_message as usize;
    line.handle_connected(attached.write, max_message);
    for reply in attached.early {
        // A second greeting makes no sense, and does no harm here.
        let _ = handle(line, reply);
    }
    attached.connection
}

fn handle(line: &Line, reply: Reply) -> Result<(), RecordError> {
    match reply {
        Reply::Deliver(delivery) => {
            line.mailbox.push(Received {
                source: delivery.source,
                destination: delivery.destination,
                priority: delivery.priority,
                broadcast: delivery.broadcast,
                payload: delivery.payload,
                path: delivery.path,
                to: line.id(),
            });
        }
        Reply::Welcome(_) | Reply::Refused(_) => return Err(RecordError::Stranger),
        outcome => line.handle_outcome(outcome),
    }
    Ok(())
}

/// Lets a component that reads, if slowly, catch up before more is read for it; one that does not
/// read at all is not waited for.
#[derive(Debug, Default)]
struct Pause {
    timer: Option<Pin<Box<Sleep>>>,
    taken: u64,
}

impl Pause {
    /// Ready when more may be read.
    fn poll(&mut self, line: &Line, cx: &mut Context<'_>) -> Poll<()> {
        if line.mailbox.poll_room(cx, ROOM).is_ready() {
            self.timer = None;
            return Poll::Ready(());
        }
        let taken = line.mailbox.taken();
        let timer = match &mut self.timer {
            Some(timer) => timer,
            None => {
                self.taken = taken;
                self.timer.insert(Box::pin(tokio::time::sleep(PATIENCE)))
            }
        };
        if timer.is_elapsed() && self.taken == taken {
            return Poll::Ready(());
        }
        if timer.as_mut().poll(cx).is_pending() {
            return Poll::Pending;
        }
        if self.taken == taken {
            return Poll::Ready(());
        }
        // It has read something meanwhile.
        self.taken = taken;
        let next = tokio::time::Instant::now() + PATIENCE;
        timer.as_mut().reset(next);
        timer.as_mut().poll(cx)
    }
}
