//! `jaus send`: sends a message, once or repeatedly, and takes control for commands.
#![expect(
    clippy::disallowed_methods,
    reason = "repeats and waits for acknowledgements in real time"
)]

use std::time::Duration;

use bytes::Bytes;
use clap::Args;
use jaus::address::JausId;
use jaus::component::{Component, SessionSettings};
use jaus::endpoint::Outgoing;
use jaus::node::{Sender, Undelivered};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime::{self, RunFor, between};
use jaus_view::Dictionary;
use serde_json::json;
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::definitions::Definitions;
use crate::lease::take_control;
use crate::offers::ask_if_not_offered;
use crate::queries::Named;

/// Send a message to a component
///
/// A message to a single component is acknowledged; one to a wildcard (65535 or 255) is sent once,
/// by multicast. With --control it takes control of the component first, makes it ready, and
/// releases it at the end: components obey commands only from the client in control. Exit status 1
/// means that the message was not acknowledged, that control was not granted, or that the component
/// does not list the message's service.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus send 101.2.33 SetWrenchEffort '{\"PropulsiveLinearEffortX\":30}' --control 127 --hz 10 \
    --for 2s\n  \
    jaus send 101.1.40 SetLamp '{\"Brightness\":80}' --jsidl services\n  \
    jaus send 65535.255.255 QueryIdentification '{\"QueryType\":2}'\n\n\
    Enumerated values may be given by name. `jaus list fields MESSAGE` shows the fields, their units \
    and values. An effort or a velocity holds for half a second: repeat it with --hz.")]
pub(crate) struct Send {
    /// The destination: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID")]
    address: JausId,

    /// The message's name
    message: String,

    /// The message's fields as JSON, as `jaus decode` prints a body
    #[arg(value_name = "JSON")]
    fields: Option<String>,

    /// Take control with this authority, from 0 to 255; the higher one wins
    #[arg(long, value_name = "AUTHORITY")]
    control: Option<u8>,

    /// Repeat the message at this rate in hertz, from 0.02 to 1000, without acknowledgement, until
    /// Ctrl-C or --for
    #[arg(long, value_parser = |text: &str| between(text, 0.02, 1000.0))]
    hz: Option<f64>,

    #[command(flatten)]
    run_for: RunFor,

    /// How long to wait for control and for the acknowledgement
    #[arg(long, default_value = "5s", value_parser = runtime::duration)]
    timeout: Duration,

    /// Print the result as a JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    definitions: Definitions,

    #[command(flatten)]
    network: Network,
}

/// What was sent.
struct Sent {
    times: u64,
    acknowledged: bool,
}

impl Send {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if self.control.is_some() {
            network::one_component(&self.address.to_string()).map_err(Failure::new)?;
        }
        let dictionary = self.definitions.load()?;
        let named = Named {
            message: &self.message,
            json: self.fields.as_deref(),
        };
        let octets = dictionary.write(&named.request()?);
        let octets = octets.map_err(|error| named.failure(&dictionary, &error))?;
        let is_command = dictionary.is_command(&octets);
        runtime::run(async {
            let joined = self.network.component_for_a_moment("jaus send");
            let (component, sender, stay) = joined.await?;
            let sent = self.send(&component, &sender, &octets).await;
            let not_offered = match sent {
                Ok(_) => self.not_offered(&component, &dictionary, &octets).await,
                Err(_) => None,
            };
            drop((component, sender));
            stay.end().await;
            self.report(&octets, &sent?)?;
            if let Some(why) = not_offered {
                say(why);
                return Ok(Outcome::Incomplete);
            }
            if is_command && self.control.is_none() {
                say(format_args!(
                    "{} is a command: components obey it only from the client in control; take \
                     control with --control AUTHORITY",
                    self.message
                ));
            }
            Ok(Outcome::Done)
        })
    }

    /// Why the component will not handle the message.
    async fn not_offered(
        &self,
        component: &Component,
        dictionary: &Dictionary,
        octets: &Bytes,
    ) -> Option<String> {
        if self.address.has_wildcard() {
            return None;
        }
        let code = u16::from_le_bytes(*octets.first_chunk()?);
        ask_if_not_offered(component, dictionary, self.address, &[code]).await
    }

    async fn send(
        &self,
        component: &Component,
        sender: &Sender,
        octets: &Bytes,
    ) -> Result<Sent, Failure> {
        let Some(authority) = self.control else {
            return self.transmit(component.id(), sender, octets).await;
        };
        let settings = SessionSettings::new(authority);
        let taken = take_control(component, self.address, settings, self.timeout);
        let mut session = taken.await?;
        let lost = async {
            loop {
                let state = session.changed().await.map_err(Failure::negative)?;
                if state.held().is_none() {
                    return Err(Failure::negative(state));
                }
            }
        };
        let sent = tokio::select! {
            sent = self.transmit(component.id(), sender, octets) => sent,
            lost = lost => lost,
        };
        session.release().await;
        sent
    }

    /// Sends the message once, or until the end at a rate.
    async fn transmit(
        &self,
        source: JausId,
        sender: &Sender,
        octets: &Bytes,
    ) -> Result<Sent, Failure> {
        let outgoing = || Outgoing::new(source, self.address, octets.clone());
        let Some(hz) = self.hz else {
            let acknowledged = self.deliver(sender, outgoing()).await?;
            if self.run_for.limit().is_some() {
                self.run_for.end().await;
            }
            return Ok(Sent {
                times: 1,
                acknowledged,
            });
        };
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut turns = interval(Duration::from_secs_f64(1.0 / hz));
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut times = 0;
        loop {
            tokio::select! {
                () = &mut end => break,
                _ = turns.tick() => {}
            }
            sender.send(outgoing()).map_err(Failure::of)?;
            times += 1;
        }
        Ok(Sent {
            times,
            acknowledged: false,
        })
    }

    /// Sends once; whether it was acknowledged, which a wildcard does not.
    async fn deliver(&self, sender: &Sender, outgoing: Outgoing) -> Result<bool, Failure> {
        if self.address.has_wildcard() {
            sender.send(outgoing).map_err(Failure::of)?;
            return Ok(false);
        }
        match timeout(self.timeout, sender.deliver(outgoing)).await {
            Ok(Ok(())) => Ok(true),
            Ok(Err(Undelivered::NotSent(error))) => Err(Failure::of(error)),
            Ok(Err(_)) | Err(_) => Err(Failure::negative(format_args!(
                "{} did not acknowledge {}. {}",
                self.address,
                self.message,
                network::REMEDY
            ))),
        }
    }

    fn report(&self, octets: &[u8], sent: &Sent) -> Result<(), Failure> {
        let (address, message) = (self.address, &self.message);
        let Sent {
            times,
            acknowledged,
        } = *sent;
        let mut output = Output::new();
        if self.json {
            let code = octets.first_chunk().map(|&code| u16::from_le_bytes(code));
            return output.line(json!({
                "destination": address.to_string(),
                "code": code.map(|code| format!("{code:04X}")),
                "message": message,
                "sent": times,
                "acknowledged": acknowledged,
            }));
        }
        match (acknowledged, times) {
            (true, _) => output.line(format_args!("{address} has acknowledged {message}")),
            (false, 1) => output.line(format_args!("sent {message} to {address}")),
            (false, _) => output.line(format_args!("sent {message} to {address} {times} times")),
        }
    }
}
