//! A client of command events (Events 1.1): sends a command and waits for its end.

use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use super::{Component, Messages, RequestError};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::command_event::CommandResult;
use crate::messages::core::{
    CancelEvent, CommandEvent, ConfirmEventRequest, CreateCommandEvent, RejectEventRequest,
};
use crate::service::{Rejection, code_of, read};

/// A command that a peer executes, see [`Component::run`]. Dropping it ends the event but not the
/// command.
///
/// ```no_run
/// # use jaus::component::{RequestError, RunningCommand};
/// # async fn example(drive: RunningCommand) {
/// let vehicle = drive.peer();
/// match drive.end().await {
///     Ok(()) => println!("{vehicle} has arrived"),
///     Err(RequestError::Unsuccessful { .. }) => println!("{vehicle} has stopped on the way"),
///     Err(error) => eprintln!("{error}"),
/// }
/// # }
/// ```
#[derive(Debug)]
#[must_use = "the peer reports the end of the command to it"]
pub struct RunningCommand {
    component: Component,
    peer: JausId,
    command: &'static str,
    request: u8,
    event: u8,
    messages: Messages,
    /// Results that came before the confirmation.
    early: Vec<CommandEvent>,
    deadline: Instant,
    limit: Duration,
    has_ended: bool,
}

impl Component {
    /// Time beyond the limit of a command in which its end must be reported.
    const END_REPORT: Duration = Duration::from_secs(1);

    /// Sends a command, and waits until the peer confirms that it has begun and will report its
    /// end. The command fails after `limit`, which is rounded up to whole seconds. This component
    /// must control the peer.
    ///
    /// ```no_run
    /// # use std::time::Duration;
    /// # use jaus::component::{Component, Session};
    /// # use jaus::messages::mobility::ExecuteList;
    /// # async fn drive(operator: Component, session: Session) -> Result<(), Box<dyn std::error::Error>> {
    /// let execute = ExecuteList { element_uid: Some(0), ..ExecuteList::default() };
    /// let limit = Duration::from_secs(60);
    /// let drive = operator.run(session.check()?, &execute, limit).await?;
    /// drive.end().await?;
    /// println!("arrived");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If the peer does not confirm, or rejects the event: it does not report the end of such
    /// commands, or this component does not control it.
    pub async fn run<C: Message>(
        &self,
        peer: JausId,
        command: &C,
        limit: Duration,
    ) -> Result<RunningCommand, RequestError> {
        let request = self.next_request();
        let seconds = limit.as_secs() + u64::from(limit.subsec_nanos() > 0);
        let create = CreateCommandEvent {
            request_id: request,
            // 0 would be no limit.
            maximum_allowed_duration: seconds.clamp(1, u32::MAX.into()) as u32,
            command_message: command.encode()?,
        };
        let deadline = Instant::now() + limit + Self::END_REPORT;
        let (mut messages, mut early) = (self.messages(), Vec::new());
        let answer = |message: &Received| {
            early.extend(ended(message));
            confirmed(request, message)
        };
        let event = self.confirm(&mut messages, peer, &create, answer).await?;
        Ok(RunningCommand {
            component: self.clone(),
            peer,
            command: C::NAME,
            request,
            event,
            messages,
            early,
            deadline,
            limit,
            has_ended: false,
        })
    }
}

impl RunningCommand {
    /// The peer that executes the command.
    #[must_use]
    pub const fn peer(&self) -> JausId {
        self.peer
    }

    /// Waits until the command has ended.
    ///
    /// # Errors
    /// [`RequestError::Unsuccessful`] if the peer reports that: it stopped or was stopped, another
    /// command replaced this one, or the limit has passed. [`RequestError::Unconfirmed`] if the peer
    /// reports nothing.
    pub async fn end(mut self) -> Result<(), RequestError> {
        let (peer, event) = (self.peer, self.event);
        let early = self.early.iter().rfind(|it| it.event_id == event);
        let mut result = early.map(|it| it.command_result);
        while result.is_none() {
            let next = timeout_at(self.deadline, self.messages.next()).await;
            let Ok(message) = next else {
                return Err(RequestError::Unconfirmed {
                    peer,
                    request: self.command,
                    waited: self.limit + Component::END_REPORT,
                });
            };
            let message = message.ok_or(RequestError::Stopped)?;
            let ended = ended(&message).filter(|_| message.source == peer);
            result = ended
                .filter(|it| it.event_id == event)
                .map(|it| it.command_result);
        }
        self.has_ended = true;
        if result == Some(CommandResult::SUCCESSFUL) {
            return Ok(());
        }
        Err(RequestError::Unsuccessful {
            peer,
            command: self.command,
        })
    }
}

impl Drop for RunningCommand {
    fn drop(&mut self) {
        if self.has_ended {
            return;
        }
        let cancel = CancelEvent {
            request_id: self.request,
            event_id: self.event,
        };
        // If it is lost, the event ends with the limit of the command.
        let _ = self.component.send(self.peer, &cancel);
    }
}

/// The number of the event, or the reason why there is none, if the message answers the request.
fn confirmed(request: u8, message: &Received) -> Option<Result<u8, String>> {
    match code_of(&message.payload)? {
        ConfirmEventRequest::CODE => {
            let confirm: ConfirmEventRequest = read(message)?;
            (confirm.request_id == request).then_some(Ok(confirm.event_id))
        }
        RejectEventRequest::CODE => {
            let (refused, reason) = Rejection::read(&message.payload)?;
            (refused == request).then(|| Err(reason.to_string()))
        }
        _ => None,
    }
}

fn ended(message: &Received) -> Option<CommandEvent> {
    let is_end = code_of(&message.payload) == Some(CommandEvent::CODE);
    is_end.then(|| read(message)).flatten()
}
