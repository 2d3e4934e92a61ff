//! Command events (1.1): a client has a command carried out, and is told of its end.
//!
//! Only one command of a code is carried out at a time, because one client is in control. Another
//! one of the same code takes the place of the first, which then has not succeeded.

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

/// Commands that may run for all clients; there are no more codes whose end services tell.
const MOST_COMMANDS: usize = 64;

/// A command that a client wants to be told of.
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

    /// The command, as if the client had sent it by itself.
    pub(in crate::service) fn command(&self) -> Received {
        Received {
            payload: self.create.command_message.clone(),
            ..self.request.clone()
        }
    }
}

/// What runs.
#[derive(Debug, Default)]
pub(super) struct Commands {
    running: BTreeMap<Name, Running>,
}

#[derive(Debug)]
struct Running {
    code: u16,
    /// When it will have failed.
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

    /// Ends those that a test is true of, and tells their clients.
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
    /// Whether a service of the component tells the end of the command, and the client may give
    /// it. If so the command runs from now on, and is to be carried out.
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
        // Whoever had this command carried out before is told that it is replaced; the same
        // client's event goes on with the new one.
        let unsuccessful = CommandResult::UNSUCCESSFUL;
        self.commands.end(unsuccessful, out, |other, it| {
            it.code == trial.code && other != name
        });
        let seconds = trial.create.maximum_allowed_duration;
        let deadline = now.checked_add(Duration::from_secs(seconds.into()));
        let running = Running {
            code: trial.code,
            // A client that sets no limit does not mean that it fails at once.
            deadline: deadline.filter(|_| seconds > 0),
        };
        self.commands.running.insert(name, running);
        out.reply(&trial.request, &confirmation(trial.create.request_id, id));
    }

    /// A service tells that the command with this code has ended.
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

    /// What has taken too long has failed, whatever becomes of it.
    pub(super) fn expire_commands(&mut self, now: Instant, out: &mut Outbox) {
        let late = |it: &Running| it.deadline.is_some_and(|deadline| deadline <= now);
        let unsuccessful = CommandResult::UNSUCCESSFUL;
        self.commands.end(unsuccessful, out, |_, it| late(it));
    }
}

/// Why a command is not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::service) enum Refusal {
    /// No service would tell when it has ended.
    NobodyTells,
    /// The client may not give it now.
    NotAllowed,
}
