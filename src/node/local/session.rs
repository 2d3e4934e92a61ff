//! A session with one component process: passes its messages to the endpoint, and its mailbox to
//! it.
//!
//! Both directions run in one task, without a queue in between: the socket is read where the
//! endpoint is called, and written where the mailbox is read. A component that does not read fills
//! the socket, and then its mailbox, which drops messages by [its
//! rule](crate::node::MailboxLimits). Its messages are not read either while too many replies to
//! them wait, so nothing here grows without bound.

use std::future::{pending, poll_fn};
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use super::super::awaiting::{Answers, Waiter};
use super::super::components::{ComponentEvent, Departure};
use super::super::core::{LAST_WORDS, Shared};
use super::super::mailbox::Mailbox;
use crate::address::JausId;
use crate::endpoint::{Outgoing, Received};
use crate::link::local::record::{Head, Record, RecordError};
use crate::link::local::{Error, Process, Reader};
use crate::wire::{Acknowledgement, Flags};

/// Octets collected for one write.
const FULL: usize = 64 << 10;
/// Limit of queued octets before reading stops: replies, besides the collected messages.
const MAX_WAITING: usize = 1 << 20;
/// How long a component may not read before that is reported as an event.
const STUCK: Duration = Duration::from_secs(2);

/// An attached component.
#[derive(Debug)]
pub(super) struct Session {
    pub(super) shared: Arc<Shared>,
    pub(super) answers: Arc<Answers>,
    pub(super) id: JausId,
    pub(super) process: Process,
    pub(super) mailbox: Arc<Mailbox>,
}

impl Session {
    /// Serves the component until it is gone or the node has stopped.
    pub(super) async fn run(self, mut reader: Reader) {
        let end = async {
            self.shared.stopped().await;
            tokio::time::sleep(LAST_WORDS).await;
        };
        let why = tokio::select! {
            biased;
            () = self.write() => Departure::Stopped,
            why = self.read(&mut reader) => why.unwrap_or_else(Departure::from),
            () = end => Departure::Stopped,
        };
        self.depart(why);
    }

    fn depart(&self, why: Departure) {
        self.shared.lock().detach(self.id, &self.mailbox, why);
    }

    /// Writes queued records until the node has stopped and all is written.
    async fn write(&self) {
        while poll_fn(|cx| self.poll_collect(cx)).await {
            if let Err(error) = self.flush().await {
                // The component reads no more. Its earlier records are still read, and reading
                // detects the end.
                tracing::debug!(id = %self.id, %error, "cannot write any more");
                self.answers.lock().close();
                return pending().await;
            }
        }
    }

    /// Collects messages. Ready with `true` when there is something to write, with `false` when
    /// there never will be.
    fn poll_collect(&self, cx: &mut Context<'_>) -> Poll<bool> {
        let mut writer = self.answers.lock();
        let drained = self.mailbox.poll_drain(cx, |message| {
            writer.queue(&delivery(message));
            writer.len() < FULL
        });
        self.mailbox
            .drain_progress(|source| writer.queue(&Head::Progress { source }.into()));
        if !writer.is_empty() {
            return Poll::Ready(true);
        }
        writer.await_more(cx);
        drained.map(|()| false)
    }

    /// Writes the collected records, and publishes an event if the component does not read for
    /// long.
    async fn flush(&self) -> Result<(), Error> {
        let mut is_stuck = false;
        loop {
            let written = {
                let mut writer = self.answers.lock();
                if writer.try_flush()? {
                    break;
                }
                writer.written()
            };
            let flushed = poll_fn(|cx| self.answers.lock().poll_flush(cx));
            match tokio::time::timeout(STUCK, flushed).await {
                Ok(flushed) => break flushed?,
                Err(_) if is_stuck || self.answers.lock().written() > written => {}
                Err(_) => {
                    is_stuck = true;
                    let (id, process) = (self.id, self.process.clone());
                    tracing::warn!(%id, %process, "component stopped reading; its messages will \
                        be dropped");
                    self.announce(ComponentEvent::Stuck { id, process });
                }
            }
        }
        if is_stuck {
            let (id, dropped) = (self.id, self.mailbox.counters().dropped);
            tracing::info!(%id, dropped, "component reads again");
            self.announce(ComponentEvent::Resumed { id, dropped });
        }
        Ok(())
    }

    fn announce(&self, event: ComponentEvent) {
        self.shared.lock().components.events.send(event);
    }

    /// Reads the component's records until it is gone.
    async fn read(&self, reader: &mut Reader) -> Result<Departure, Error> {
        while !self.handle_records(reader)? {
            // Send the outcomes of these records before reading more.
            self.answers.lock().flush_now();
            // Writing has its turn before each check, and continues when the component reads.
            let may_read = || self.answers.lock().len() < MAX_WAITING;
            reader.fill(may_read).await?;
        }
        Ok(Departure::Left)
    }

    /// Handles the records read so far; returns whether the component leaves.
    ///
    /// A message that is cancelled further on is not sent at all: a node that did not run for a
    /// while must not send late commands that nobody waits for.
    fn handle_records(&self, reader: &mut Reader) -> Result<bool, RecordError> {
        let mut records = Vec::new();
        let end = loop {
            match reader.next_record() {
                Ok(Some(Record {
                    head: Head::Cancel { handle },
                    payload,
                })) => match records.iter().position(|it| is_sent_as(it, handle)) {
                    Some(place) => drop(records.remove(place)),
                    None => records.push(Record {
                        head: Head::Cancel { handle },
                        payload,
                    }),
                },
                Ok(Some(record)) => records.push(record),
                Ok(None) => break Ok(false),
                Err(error) => break Err(error),
            }
        };
        match self.handle_all(records)? {
            true => Ok(true),
            false => end,
        }
    }

    fn handle_all(&self, records: Vec<Record>) -> Result<bool, RecordError> {
        let mut core = None;
        for Record { head, payload } in records {
            match head {
                Head::Send {
                    flags,
                    handle,
                    destination,
                } => {
                    let message = Outgoing {
                        source: self.id,
                        destination,
                        priority: flags.priority(),
                        broadcast: flags.broadcast().unwrap_or_default(),
                        acknowledge: flags.acknowledgement() == Acknowledgement::Request,
                        payload,
                    };
                    let waiter = message.acknowledge.then(|| Waiter::There {
                        answers: self.answers.clone(),
                        handle,
                    });
                    let core = core.get_or_insert_with(|| self.shared.lock());
                    if let Err(error) = core.send(message, waiter) {
                        self.answers.send(handle, Err(error.into()));
                    }
                }
                Head::Cancel { handle } => {
                    let core = core.get_or_insert_with(|| self.shared.lock());
                    core.cancel_of_process(self.id, handle);
                }
                Head::Leave => return Ok(true),
                _ => return Err(RecordError::Unexpected),
            }
        }
        Ok(false)
    }
}

impl Drop for Session {
    /// Also runs when the runtime ends.
    fn drop(&mut self) {
        self.depart(Departure::Stopped);
    }
}

/// Whether a record is the message that its component knows by this handle.
fn is_sent_as(record: &Record, wanted: u64) -> bool {
    matches!(record.head, Head::Send { handle, .. } if handle == wanted)
}

fn delivery(message: Received) -> Record {
    let flags = Flags::new(message.priority).with_broadcast(message.broadcast);
    let flags = match message.acknowledged {
        true => flags.with_acknowledgement(Acknowledgement::Request),
        false => flags,
    };
    Record {
        head: Head::Deliver {
            flags,
            source: message.source,
            destination: message.destination,
            sequence: message.sequence.unwrap_or_default(),
            path: message.path,
        },
        payload: message.payload,
    }
}
