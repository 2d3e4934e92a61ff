//! The node's side of the [local link](crate::link::local): who comes in, and as whom.
//!
//! One task waits at the door; each component has a [session](session) in a task of its own, so
//! that a stuck one holds up nobody. To the endpoint they are components like those of the node's
//! own process.
#![expect(
    clippy::disallowed_methods,
    reason = "the node gives guests a task and little time to greet"
)]

mod session;

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Semaphore;

use self::session::Session;
use super::attendance::{ComponentEvent, Departure};
use super::core::Shared;
use super::mailbox::Mailbox;
use crate::address::JausId;
use crate::endpoint::AttachError;
use crate::link::local::record::{
    self, Hello, LONGEST_HELLO, Reason, Refusal, Reply, Request, VERSION, Want, Welcome,
};
use crate::link::local::{Connection, Door, Error, Guest, Outbox, Process, WriteHalf};

/// Guests that may stand in the door without having said who they are.
const UNGREETED: usize = 32;
/// How long they may stand there.
const GREETING: Duration = Duration::from_secs(5);
/// How long the id of a component that has just died may still seem taken: its end and its
/// successor's greeting can be noticed in either order.
const OVERLAP: Duration = Duration::from_millis(200);

/// What sessions need to know about the node.
#[derive(Debug)]
pub(super) struct Reception {
    shared: Arc<Shared>,
    /// The id of component 0, so to speak.
    node: (u16, u8),
    max_message: usize,
}

impl Reception {
    pub(super) const fn new(shared: Arc<Shared>, node: (u16, u8), max_message: usize) -> Self {
        Self {
            shared,
            node,
            max_message,
        }
    }

    /// Opens the door; who serves guests at it until the node has stopped.
    pub(super) fn open(self, door: Door) -> impl Future<Output = ()> + use<> {
        let open = OpenDoor::new(door, self.shared.clone());
        self.serve(open)
    }

    async fn serve(self, open: OpenDoor) {
        let mut stopped = self.shared.stopped.subscribe();
        let this = Arc::new(self);
        let ungreeted = Arc::new(Semaphore::new(UNGREETED));
        loop {
            let Ok(permit) = ungreeted.clone().acquire_owned().await else {
                return;
            };
            let guest = tokio::select! {
                guest = open.door.accept() => guest,
                _ = stopped.wait_for(|stopped| *stopped) => return,
            };
            match guest {
                Ok(guest) => {
                    let this = this.clone();
                    tokio::spawn(async move {
                        let session = this.greet(guest).await;
                        drop(permit);
                        if let Some(session) = session {
                            session.run().await;
                        }
                    });
                }
                Err(error) => {
                    tracing::warn!(%error, "somebody did not get in");
                    // Out of file descriptors, perhaps; it must not be tried without pause.
                    if matches!(error, Error::Io { .. }) {
                        tokio::time::sleep(Duration::from_millis(100)).await;
                    }
                }
            }
        }
    }

    /// Asks a guest who it is, and takes it in or sends it away.
    async fn greet(&self, guest: Guest) -> Option<Session> {
        let Guest { read, write, pid } = guest;
        let mut connection = Connection::new(read, LONGEST_HELLO);
        let hello = tokio::time::timeout(GREETING, hear(&mut connection)).await;
        let hello = match hello {
            Ok(Ok(hello)) => hello,
            Ok(Err(error)) => {
                tracing::warn!(?pid, %error, "somebody at the local link is no component");
                return None;
            }
            Err(_) => {
                tracing::warn!(?pid, "somebody at the local link says nothing");
                return None;
            }
        };
        let process = Process {
            pid,
            name: hello.name.clone(),
        };
        let mut write = write;
        match self.admit(&hello, &process).await {
            Ok((id, mailbox)) => {
                connection.set_limit(self.max_message + record::LONGEST - record::LONGEST_MESSAGE);
                let welcome = Welcome {
                    id,
                    max_message: u32::try_from(self.max_message).unwrap_or(u32::MAX),
                };
                let session =
                    Session::new(self.shared.clone(), connection, write, id, process, mailbox);
                Some(session.with(&Reply::Welcome(welcome)))
            }
            Err(refusal) => {
                tracing::warn!(%process, why = refusal.words, "component refused");
                let why = refusal.words.clone();
                let event = ComponentEvent::Refused { process, why };
                self.shared.lock().attendance.announce(event);
                say(&mut write, Reply::Refused(refusal)).await;
                None
            }
        }
    }

    async fn admit(
        &self,
        hello: &Hello,
        process: &Process,
    ) -> Result<(JausId, Arc<Mailbox>), Refusal> {
        let id = self.wanted_id(hello)?;
        let deadline = tokio::time::Instant::now() + OVERLAP;
        loop {
            let (error, holder) = {
                let mut core = self.shared.lock();
                if core.is_stopping() {
                    return Err(refusal(Reason::Stopping, "the node is about to stop"));
                }
                match core.attach(id, Some(process.clone())) {
                    Ok(mailbox) => return Ok((id, mailbox)),
                    Err(error) => (error, core.attendance.process(id).cloned()),
                }
            };
            let may_be_dead = matches!(error, AttachError::AlreadyAttached(_)) && holder.is_some();
            if !may_be_dead || tokio::time::Instant::now() >= deadline {
                return Err(refused(error, holder));
            }
            tokio::time::sleep(OVERLAP / 10).await;
        }
    }

    fn wanted_id(&self, hello: &Hello) -> Result<JausId, Refusal> {
        if hello.version != VERSION {
            let words = format!(
                "the component speaks version {} of the local link's protocol, the node version \
                 {VERSION}: build both with the same release",
                hello.version
            );
            return Err(refusal(Reason::Version, words));
        }
        let (subsystem, node) = self.node;
        match hello.want {
            Want::Component(number) => Ok(JausId::new(subsystem, node, number)),
            Want::Id(id) if (id.subsystem(), id.node()) == self.node => Ok(id),
            Want::Id(id) => {
                let words = format!(
                    "{id} does not belong to this node, whose components are \
                     {subsystem}.{node}.1 to {subsystem}.{node}.254"
                );
                Err(refusal(Reason::WrongId, words))
            }
        }
    }
}

/// A door, and who waits until it is closed: the next node of this host may want its place.
#[derive(Debug)]
struct OpenDoor {
    door: Door,
    _last: ClosedLast,
}

/// Says that the door is closed; as its last field it is dropped after it.
#[derive(Debug)]
struct ClosedLast(Arc<Shared>);

impl OpenDoor {
    fn new(door: Door, shared: Arc<Shared>) -> Self {
        shared.closed.send_replace(false);
        let _last = ClosedLast(shared);
        Self { door, _last }
    }
}

impl Drop for ClosedLast {
    fn drop(&mut self) {
        self.0.closed.send_replace(true);
    }
}

fn refusal(reason: Reason, words: impl Into<String>) -> Refusal {
    let words = words.into();
    Refusal { reason, words }
}

fn refused(error: AttachError, holder: Option<Process>) -> Refusal {
    let reason = match error {
        AttachError::AlreadyAttached(id) => {
            let holder = match holder {
                Some(process) => process.to_string(),
                None => format!("the node itself (process {})", std::process::id()),
            };
            let words = format!("{id} is held by {holder}: choose another component number");
            return refusal(Reason::Taken, words);
        }
        AttachError::TooMany { .. } => Reason::TooMany,
        _ => Reason::WrongId,
    };
    refusal(reason, error.to_string())
}

/// Waits for a guest's first word, which must be its greeting and its only one for now.
async fn hear(connection: &mut Connection) -> Result<Hello, Error> {
    let mut hello = None;
    while hello.is_none() {
        let read = std::future::poll_fn(|cx| {
            connection.poll_read(cx, |body| match Request::decode(&body)? {
                Request::Hello(said) if hello.is_none() => {
                    hello = Some(said);
                    Ok(())
                }
                _ => Err(record::RecordError::Stranger),
            })
        });
        read.await?;
    }
    hello.ok_or(Error::Closed)
}

/// Says a last word, as far as the guest listens.
async fn say(write: &mut WriteHalf, word: Reply) {
    let mut outbox = Outbox::default();
    outbox.reply(&word);
    let said = std::future::poll_fn(|cx| outbox.poll_flush(write, cx));
    // Who does not listen is not told.
    let _ = tokio::time::timeout(GREETING, said).await;
}

impl From<&Error> for Departure {
    fn from(error: &Error) -> Self {
        match error {
            Error::Closed => Self::Vanished,
            Error::Io { source, .. } if source.kind() == std::io::ErrorKind::ConnectionReset => {
                Self::Vanished
            }
            Error::Io { source, .. } if source.kind() == std::io::ErrorKind::BrokenPipe => {
                Self::Vanished
            }
            error => Self::Failed(error.to_string()),
        }
    }
}
