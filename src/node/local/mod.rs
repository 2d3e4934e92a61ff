//! The node's side of the [local link](crate::link::local): accepts component processes and assigns
//! their ids.
//!
//! One task accepts connections. Each component has a [session] in its own task, so that a stuck
//! one does not delay others. To the endpoint they are like components of the node's own process.
#![expect(
    clippy::disallowed_methods,
    reason = "sessions have tasks, and the first record has a timeout"
)]

mod session;
mod users;

use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use jaus_limits::Yielding;
use tokio::sync::watch;
use tokio::task::AbortHandle;
use tokio::time::timeout;

use self::session::Session;
use super::Config;
use super::awaiting::Answers;
use super::components::{ComponentEvent, Departure};
use super::core::Shared;
use super::mailbox::Mailbox;
use crate::address::JausId;
use crate::endpoint::AttachError;
use crate::link::local::record::{
    Head, LONGEST_HEAD, LONGEST_HELLO, Reason, Record, RecordError, VERSION,
};
use crate::link::local::{Error, Listener, OtherEnd, Process, Reader, Stream, Writer};

/// Limit of connections whose component is not attached yet. If there are more, the oldest of the user with
/// the most gives way, so that no number of silent ones keeps a component out.
const UNATTACHED: usize = 32;
/// How long a component may take to send its first record, and to read a refusal.
const HANDSHAKE: Duration = Duration::from_secs(5);
/// How long the id of a component that has just died may still seem taken: its end and its
/// successor's first record may be noticed in either order.
const OVERLAP: Duration = Duration::from_millis(200);

/// Why a component is not attached.
type Refusal = (Reason, String);

/// Accepts components until the node has stopped. The listener, as the last parameter, is dropped
/// before `_listening` tells so, because the next node of this host may need the same address.
pub(super) async fn serve(
    shared: Arc<Shared>,
    _listening: watch::Receiver<()>,
    listener: Listener,
) {
    let mut unattached = Yielding::new(UNATTACHED);
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = shared.stopped() => return,
        };
        match accepted {
            Ok(stream) => {
                let user = stream.peer.uid;
                let (shared, attaching) = (shared.clone(), Arc::new(()));
                let is_attaching = Arc::downgrade(&attaching);
                let task = tokio::spawn(async move {
                    let attached = attach(&shared, stream).await;
                    drop(attaching);
                    if let Some((session, reader)) = attached {
                        session.run(reader).await;
                    }
                });
                let is_done = |(it, _): &(Weak<()>, AbortHandle)| it.strong_count() == 0;
                let holder = (is_attaching, task.abort_handle());
                if let Some((_, oldest)) = unattached.add(user, holder, is_done) {
                    oldest.abort();
                }
            }
            Err(error) => {
                tracing::warn!(%error, "cannot accept a component");
                // For instance too many open files: do not retry at once.
                if matches!(error, Error::Socket(_)) {
                    tokio::time::sleep(OVERLAP).await;
                }
            }
        }
    }
}

/// Attaches the component at the other end of a connection, or sends it the reason for a
/// refusal.
async fn attach(shared: &Arc<Shared>, stream: Stream) -> Option<(Session, Reader)> {
    let Stream { read, write, peer } = stream;
    let OtherEnd { pid, uid } = peer;
    let (mut reader, mut writer) = (Reader::new(read, LONGEST_HELLO), Writer::new(write));
    let hello = async {
        let record = reader.read().await?;
        match record.head {
            Head::Hello { version, id } => Ok((version, id, record.text())),
            _ => Err(Error::Record(RecordError::Unexpected)),
        }
    };
    let (version, id, name) = match timeout(HANDSHAKE, hello).await {
        Ok(Ok(hello)) => hello,
        Ok(Err(error)) => {
            tracing::warn!(?pid, %error, "rejected a connection to the local link: not a component");
            return None;
        }
        Err(_) => {
            tracing::warn!(?pid, "closed a silent connection to the local link");
            return None;
        }
    };
    let process = Process { pid, name };
    match admit(shared, (version, id), uid, &process).await {
        Ok((id, mailbox)) => {
            let max_message = u32::try_from(shared.config.max_message).unwrap_or(u32::MAX);
            reader.set_limit(max_message as usize + LONGEST_HEAD);
            writer.queue(&Head::Welcome { id, max_message }.into());
            let session = Session {
                shared: shared.clone(),
                answers: Arc::new(Answers(Mutex::new(writer))),
                id,
                process,
                mailbox,
            };
            Some((session, reader))
        }
        Err((reason, why)) => {
            tracing::warn!(%process, why, "component refused");
            writer.queue(&Record::with_text(Head::Refused(reason), &why));
            let event = ComponentEvent::Refused { process, why };
            shared.lock().components.events.send(event);
            // A component that does not read misses the reason.
            let _ = timeout(HANDSHAKE, writer.flush()).await;
            None
        }
    }
}

async fn admit(
    shared: &Shared,
    (version, wanted): (u8, JausId),
    uid: Option<u32>,
    process: &Process,
) -> Result<(JausId, Arc<Mailbox>), Refusal> {
    let id = full_id(&shared.config, version, wanted)?;
    let rules = users::rights_of(&shared.config.local_users, uid, id).await?;
    let deadline = tokio::time::Instant::now() + OVERLAP;
    loop {
        if shared.lock().stop_at.is_some() {
            return Err((Reason::Stopping, "the node is stopping".to_owned()));
        }
        let error = match shared.attach(id, Some(process.clone())) {
            Ok(mailbox) => {
                // Nothing of it is read before this.
                if let Some(rules) = rules {
                    shared.lock().endpoint.restrict(id, rules);
                }
                return Ok((id, mailbox));
            }
            Err(error) => error,
        };
        let holder = shared.lock().components.process(id).cloned();
        let may_be_dead = matches!(error, AttachError::AlreadyAttached(_)) && holder.is_some();
        if !may_be_dead || tokio::time::Instant::now() >= deadline {
            return Err(refusal(&error, holder));
        }
        tokio::time::sleep(OVERLAP / 10).await;
    }
}

/// The id to assign to a component.
fn full_id(config: &Config, version: u8, wanted: JausId) -> Result<JausId, Refusal> {
    if version != VERSION {
        let why = format!(
            "the component uses version {version} of the local link's protocol, the node \
             version {VERSION}: build both from the same release"
        );
        return Err((Reason::Version, why));
    }
    let (subsystem, node) = (config.subsystem, config.node);
    let names_node = (wanted.subsystem(), wanted.node()) != (0, 0);
    let id = JausId::new(subsystem, node, wanted.component());
    if names_node && wanted != id {
        let why = format!(
            "{wanted} does not belong to this node, whose components are {subsystem}.{node}.1 to \
             {subsystem}.{node}.254"
        );
        return Err((Reason::WrongId, why));
    }
    Ok(id)
}

fn refusal(error: &AttachError, holder: Option<Process>) -> Refusal {
    let words = error.to_string();
    match error {
        AttachError::AlreadyAttached(id) => {
            let itself = || format!("the node itself (process {})", std::process::id());
            let holder = holder.map_or_else(itself, |process| process.to_string());
            let why = format!("{id} is used by {holder}: choose another component number");
            (Reason::Taken, why)
        }
        AttachError::TooMany { .. } => (Reason::TooMany, words),
        AttachError::Link(_) => (Reason::Taken, words),
        _ => (Reason::WrongId, words),
    }
}

impl From<Error> for Departure {
    fn from(error: Error) -> Self {
        match error {
            Error::Closed => Self::Vanished,
            error => Self::Failed(error.to_string()),
        }
    }
}
