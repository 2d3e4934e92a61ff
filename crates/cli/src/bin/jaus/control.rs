//! `jaus control`: takes control of a component and changes its state.
#![expect(
    clippy::disallowed_methods,
    reason = "control has timeouts in real time"
)]

use std::io::{self, BufRead};
use std::time::Duration;

use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::component::{Component, Session, SessionSettings, SessionState, TargetState};
use jaus::messages::core::QueryStatus;
use jaus::service::State;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime::{self, Clock, RunFor};
use serde_json::json;
use tokio::sync::mpsc;
use tokio::time::timeout;

use crate::lease::take_control;

/// Take control of a component, change its state, set or clear an emergency
///
/// Takes the actions in turn, then releases control. `hold` keeps it until Ctrl-C or --for, prints
/// each change, and takes further actions from standard input, one on a line. Exit status 1 means
/// that control was not granted, or that the component did not report the wanted state.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus control 101.2.33                      holds control; then type resume, standby …\n  \
    jaus control 101.2.33 resume hold --for 1min\n  \
    jaus control 101.2.33 emergency            needs no control; stops the component\n  \
    jaus control 101.2.33 clear                by the same --id, or once the setter is gone")]
pub(crate) struct ControlCommand {
    /// The component: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID", value_parser = network::one_component)]
    address: JausId,

    /// What to do, in turn
    #[arg(value_enum, default_value = "hold")]
    actions: Vec<Action>,

    /// The authority, from 0 to 255; the higher one wins
    #[arg(long, default_value = "127")]
    authority: u8,

    #[command(flatten)]
    run_for: RunFor,

    /// How long to wait for control and for each state
    #[arg(long, default_value = "5s", value_parser = runtime::duration)]
    timeout: Duration,

    /// Print a JSON object for each change
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    network: Network,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Action {
    /// Keep control until Ctrl-C or --for
    Hold,
    /// Make the component ready: it obeys commands
    Resume,
    /// Put it into standby
    Standby,
    /// Set an emergency
    Emergency,
    /// Clear the emergency
    Clear,
    /// Clear the emergencies of all clients, which requires the right `clear-emergency=any`
    ClearAll,
    /// Release control
    Release,
}

impl ControlCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let joined = self.network.component_for_a_moment("jaus control");
            let (component, _, stay) = joined.await?;
            let mut operator = Operator {
                command: self,
                component,
                session: None,
                printed: None,
                output: Output::new(),
                clock: Clock::start(),
            };
            let done = tokio::select! {
                done = operator.perform_all() => done,
                () = runtime::end(None) => Ok(()),
            };
            let released = operator.release().await;
            drop(operator);
            stay.end().await;
            done.and(released).map(|()| Outcome::Done)
        })
    }
}

/// The client that performs the actions.
struct Operator<'c> {
    command: &'c ControlCommand,
    component: Component,
    session: Option<Session>,
    /// The last printed state.
    printed: Option<SessionState>,
    output: Output,
    clock: Clock,
}

impl Operator<'_> {
    async fn perform_all(&mut self) -> Result<(), Failure> {
        for &action in &self.command.actions {
            match action {
                Action::Hold => self.hold().await?,
                action => self.perform(action).await?,
            }
        }
        Ok(())
    }

    /// Performs an action other than `hold`.
    async fn perform(&mut self, action: Action) -> Result<(), Failure> {
        let (peer, limit) = (self.command.address, self.command.timeout);
        match action {
            Action::Hold => self.take().await.map(drop),
            Action::Resume => {
                let resumed = timeout(limit, self.take().await?.resume()).await;
                self.expect_state("ready", resumed.is_ok_and(|it| it.is_ok()))
            }
            Action::Standby => {
                let standing = timeout(limit, self.take().await?.standby()).await;
                self.expect_state("standby", standing.is_ok_and(|it| it.is_ok()))
            }
            Action::Emergency => {
                let set = self.component.set_emergency(peer).await;
                set.map_err(Failure::negative)?;
                self.tell("emergency", format_args!("{peer} is in emergency"))
            }
            Action::Clear => self.clear().await,
            Action::ClearAll => {
                let cleared = self.component.clear_all_emergencies(peer).await;
                cleared.map_err(Failure::negative)?;
                self.expect_no_emergency(
                    "over a secure link with the right clear-emergency=any, or from the peer's \
                     node, unless its stop input is pressed",
                )
                .await
            }
            Action::Release => self.release().await,
        }
    }

    /// Clears an emergency: as its setter, or else as the client in control.
    async fn clear(&mut self) -> Result<(), Failure> {
        let peer = self.command.address;
        for is_in_control in [false, true] {
            if is_in_control && self.take().await.is_err() {
                break;
            }
            let cleared = self.component.clear_emergency(peer).await;
            cleared.map_err(Failure::negative)?;
            if !self.is_in_emergency().await? {
                break;
            }
        }
        self.expect_no_emergency(
            "as the client that has set it (--id), once that client has been gone for 4 s, or with \
             clear-all",
        )
        .await
    }

    async fn is_in_emergency(&self) -> Result<bool, Failure> {
        let status = self.component.query(self.command.address, &QueryStatus {});
        let code = status.await.map_err(Failure::negative)?.status.0;
        Ok(State::from_code(code) == Some(State::Emergency))
    }

    /// Reports the end of the emergency, or else how it can be cleared.
    async fn expect_no_emergency(&mut self, how: &str) -> Result<(), Failure> {
        let peer = self.command.address;
        if self.is_in_emergency().await? {
            let words = format_args!("{peer} is still in emergency: clear it {how}");
            return Err(Failure::negative(words));
        }
        self.tell("clear", format_args!("{peer} is in no emergency"))
    }

    /// The session; begins it if there is none.
    async fn take(&mut self) -> Result<&Session, Failure> {
        let session = match self.session.take() {
            Some(session) => session,
            None => {
                let ControlCommand {
                    address,
                    authority,
                    timeout,
                    ..
                } = *self.command;
                let settings = SessionSettings::new(authority).target(TargetState::AsFound);
                let session = take_control(&self.component, address, settings, timeout).await?;
                self.print_state(session.state())?;
                session
            }
        };
        Ok(self.session.insert(session))
    }

    async fn release(&mut self) -> Result<(), Failure> {
        let Some(session) = self.session.take() else {
            return Ok(());
        };
        session.release().await;
        let peer = self.command.address;
        self.tell("released", format_args!("{peer} is released"))
    }

    /// Keeps control, prints changes, and performs the actions of the input.
    async fn hold(&mut self) -> Result<(), Failure> {
        self.take().await?;
        let mut input = input_lines();
        let end = self.command.run_for.end();
        tokio::pin!(end);
        while let Some(session) = &mut self.session {
            tokio::select! {
                () = &mut end => return Ok(()),
                state = session.changed() => {
                    let state = state.map_err(Failure::negative)?;
                    self.print_state(state)?;
                    if let SessionState::Lost { continues: false, .. } = state {
                        return Err(Failure::negative(state));
                    }
                }
                Some(line) = input.recv() => self.obey(&line).await?,
            }
        }
        Ok(())
    }

    /// Performs an action of the input. Its failure does not end the command.
    async fn obey(&mut self, line: &str) -> Result<(), Failure> {
        let known = Action::value_variants().iter();
        let names: Vec<_> = known
            .filter_map(|it| Some(it.to_possible_value()?.get_name().to_owned()))
            .collect();
        match Action::from_str(line.trim(), true) {
            Ok(action) => match self.perform(action).await {
                Err(Failure::Negative(reason)) => say(reason),
                result => result?,
            },
            Err(_) if line.trim().is_empty() => {}
            Err(_) => say(format_args!(
                "no action {line:?}: write {}",
                names.join(", ")
            )),
        }
        Ok(())
    }

    /// Reports the state after an action.
    fn expect_state(&mut self, wanted: &str, is_reached: bool) -> Result<(), Failure> {
        let state = self.session.as_ref().map(Session::state);
        let state = state.unwrap_or(SessionState::Released);
        match is_reached {
            true => self.print_state(state),
            false => Err(Failure::negative(format_args!("not {wanted}: {state}"))),
        }
    }

    fn print_state(&mut self, state: SessionState) -> Result<(), Failure> {
        if self.printed.replace(state) == Some(state) {
            return Ok(());
        }
        let name = match state {
            SessionState::Seeking | SessionState::Requesting(_) => "requesting",
            SessionState::Preparing(_) => "preparing",
            SessionState::Ready(_) => "ready",
            SessionState::Standby(_) => "standby",
            SessionState::Disabled { .. } => "disabled",
            SessionState::Lost { .. } => "lost",
            SessionState::Released => "released",
        };
        self.tell(name, state)
    }

    fn tell(&mut self, event: &str, words: impl std::fmt::Display) -> Result<(), Failure> {
        if self.command.json {
            return self.output.line(json!({
                "component": self.command.address.to_string(),
                "event": event,
                "text": words.to_string(),
            }));
        }
        self.output.line(format_args!("{}  {words}", self.clock))
    }
}

/// The lines of standard input. At its end, none comes any more.
fn input_lines() -> mpsc::UnboundedReceiver<String> {
    let (lines, input) = mpsc::unbounded_channel();
    // A thread of its own, because the runtime would wait for a read at its end.
    std::thread::spawn(move || {
        for line in io::stdin().lock().lines().map_while(Result::ok) {
            if lines.send(line).is_err() {
                return;
            }
        }
    });
    input
}
