//! Command events (1.1): a client has a command run, and is notified of its end.
//!
//! Only one command per code runs at a time, because only one client is in control. Another command
//! with the same code replaces the first one, which then counts as unsuccessful.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::table::Name;
use super::{Events, confirmation, reject};
use crate::address::JausId;
use crate::endpoint::Received;
use crate::messages::core::command_event::CommandResult;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::messages::core::{CommandEvent, CreateCommandEvent};
use crate::service::{Outbox, code_of};

/// Limit of commands that run for all clients. Services do not report the end of more codes.
pub(super) const MOST_COMMANDS: usize = 64;

/// A command event that a client requests.
#[derive(Debug)]
pub(in crate::service) struct CommandTrial {
    request: Received,
    create: CreateCommandEvent,
    /// The code of the command.
    pub(in crate::service) code: u16,
}

impl CommandTrial {
    pub(super) fn new(
        request: &Received,
        create: CreateCommandEvent,
    ) -> Result<Self, ResponseCode> {
        let code = code_of(&create.command_message).ok_or(ResponseCode::INVALID_EVENT_SETUP)?;
        let request = request.clone();
        Ok(Self {
            request,
            create,
            code,
        })
    }

    pub(in crate::service) const fn client(&self) -> JausId {
        self.request.source
    }

    /// The command, as if the client had sent it directly.
    pub(in crate::service) fn command(&self) -> Received {
        Received {
            payload: self.create.command_message.clone(),
            ..self.request.clone()
        }
    }
}

/// The running commands.
#[derive(Debug, Default)]
pub(super) struct Commands {
    running: BTreeMap<Name, Running>,
}

#[derive(Debug)]
struct Running {
    code: u16,
    /// When it times out.
    deadline: Option<Instant>,
}

impl Commands {
    pub(super) fn contains(&self, name: Name) -> bool {
        self.running.contains_key(&name)
    }

    pub(super) fn remove(&mut self, name: Name) -> bool {
        self.running.remove(&name).is_some()
    }

    pub(super) fn remove_client(&mut self, client: JausId) {
        self.running.retain(|&(of, _), _| of != client);
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.running.values().filter_map(|it| it.deadline).min()
    }

    /// Ends the commands that `which` selects, and notifies their clients.
    fn end(
        &mut self,
        result: CommandResult,
        out: &mut Outbox,
        which: impl Fn(Name, &Running) -> bool,
    ) {
        self.running.retain(|&name, running| {
            let ends = which(name, running);
            if ends {
                let (client, event_id) = name;
                let event = CommandEvent {
                    event_id,
                    command_result: result,
                };
                out.send(client, &event);
            }
            !ends
        });
    }
}

impl Events {
    /// Begins a command event unless `refusal` gives a reason not to. Returns whether the command
    /// must now be run.
    pub(in crate::service) fn begin_command(
        &mut self,
        now: Instant,
        trial: &CommandTrial,
        refusal: Option<Refusal>,
        out: &mut Outbox,
    ) -> bool {
        let client = trial.client();
        let known = self.commands.running.iter();
        let mut known = known.filter(|((of, _), it)| *of == client && it.code == trial.code);
        let known = known.next().map(|(&(_, id), _)| id);
        let id = known.or_else(|| self.free_id(client));
        let room = known.is_some() || self.commands.running.len() < MOST_COMMANDS;
        let why = match (refusal, id) {
            (Some(Refusal::NobodyTells), _) => ResponseCode::MESSAGE_NOT_SUPPORTED,
            (None, Some(id)) if room => {
                self.run(now, trial, id, out);
                return true;
            }
            _ => ResponseCode::CONNECTION_REFUSED,
        };
        reject(&trial.request, trial.create.request_id, why, out);
        false
    }

    fn run(&mut self, now: Instant, trial: &CommandTrial, id: u8, out: &mut Outbox) {
        let name = (trial.client(), id);
        // Notify the other clients with this command that it is replaced. An event of the same
        // client continues with the new command.
        let unsuccessful = CommandResult::UNSUCCESSFUL;
        self.commands.end(unsuccessful, out, |other, it| {
            it.code == trial.code && other != name
        });
        let seconds = trial.create.maximum_allowed_duration;
        let deadline = now.checked_add(Duration::from_secs(seconds.into()));
        let running = Running {
            code: trial.code,
            // 0 means no limit, not immediate failure.
            deadline: deadline.filter(|_| seconds > 0),
        };
        self.commands.running.insert(name, running);
        out.reply(&trial.request, &confirmation(trial.create.request_id, id));
    }

    /// Ends the command with this code, as a service has reported.
    pub(in crate::service) fn end_command(
        &mut self,
        code: u16,
        successful: bool,
        out: &mut Outbox,
    ) {
        let result = if successful {
            CommandResult::SUCCESSFUL
        } else {
            CommandResult::UNSUCCESSFUL
        };
        self.commands.end(result, out, |_, it| it.code == code);
    }

    /// Ends commands that have timed out as unsuccessful, whatever happens to them later.
    pub(super) fn expire_commands(&mut self, now: Instant, out: &mut Outbox) {
        let late = |it: &Running| it.deadline.is_some_and(|deadline| deadline <= now);
        let unsuccessful = CommandResult::UNSUCCESSFUL;
        self.commands.end(unsuccessful, out, |_, it| late(it));
    }
}

/// Why a command is not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::service) enum Refusal {
    /// No service reports its end.
    NobodyTells,
    /// The client may not send it now.
    NotAllowed,
}
