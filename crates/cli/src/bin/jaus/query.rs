//! `jaus query`: sends a query to a component and prints the report.
#![expect(
    clippy::disallowed_methods,
    reason = "queries have a timeout in real time"
)]

use std::collections::BTreeSet;
use std::time::Duration;

use bytes::Bytes;
use clap::Args;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::core::ReportServices;
use jaus::node::Port;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime;
use jaus_view::{Dictionary, EncodedQuery, Line};
use serde::Serialize;
use tokio::time::{Instant, timeout_at};

use crate::definitions::Definitions;
use crate::offers::{not_offered, query_services};
use crate::queries::{Fields, Named, in_words};

/// Interval of repeated queries without an answer.
const AGAIN: Duration = Duration::from_millis(500);

/// Query a component and print its report as JSON, or as text with units
///
/// With a wildcard in the address (65535 or 255) all reports that arrive in time are printed. Exit
/// status 1 means that there was no answer. If the component does not list the query's service, its
/// name is printed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus query 101.1.1 QueryIdentification '{\"QueryType\":2}'\n  \
    jaus query 101.1.1 QueryHeartbeatPulse\n  \
    jaus query 101.1.33 QueryVelocityState --fields Velocity_X,Yaw_Rate --text\n  \
    jaus query 65535.255.255 QueryIdentification '{\"QueryType\":2}' --timeout 1s\n  \
    jaus query 101.1.1 QueryHeartbeatPulse --peer 192.168.7.2")]
pub(crate) struct Query {
    /// The component to query: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID")]
    address: JausId,

    /// The query's name
    message: String,

    /// The query's fields, as `jaus decode` prints a body
    json: Option<String>,

    #[command(flatten)]
    fields: Fields,

    /// Print text with units instead of JSON
    #[arg(long)]
    text: bool,

    /// How long to wait for an answer, and with a wildcard for further ones
    #[arg(long, default_value = "2s", value_parser = runtime::duration)]
    timeout: Duration,

    #[command(flatten)]
    definitions: Definitions,

    #[command(flatten)]
    network: Network,
}

impl Query {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let dictionary = self.definitions.load()?;
        let query = Named {
            message: &self.message,
            json: self.json.as_deref(),
        };
        let mut queries = self.fields.encode(&dictionary, &[query])?;
        let query = queries.remove(0);
        runtime::run(async {
            let (port, stay) = self.network.join_for_a_moment().await?;
            let outcome = self.ask(port, &query, &dictionary).await;
            stay.end().await;
            outcome
        })
    }

    /// Repeats the query until the answer; with wildcards until the time is over.
    async fn ask(
        &self,
        mut port: Port,
        query: &EncodedQuery,
        dictionary: &Dictionary,
    ) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        let mut answered = BTreeSet::new();
        let mut complete = true;
        let end = Instant::now() + self.timeout;
        let mut is_repeated = false;
        while Instant::now() < end {
            self.send(&port, query.octets.clone())?;
            if is_repeated && !self.address.has_wildcard() {
                let services = query_services(self.address).encode();
                self.send(&port, services.map_err(Failure::of)?)?;
            }
            is_repeated = true;
            let again = end.min(Instant::now() + AGAIN);
            while let Ok(Some(received)) = timeout_at(again, port.recv()).await {
                if !self.is_answer(&received, query.report) {
                    if let Some(why) = self.not_offered(&received, query, dictionary) {
                        say(why);
                        return Ok(Outcome::Incomplete);
                    }
                    continue;
                }
                if !answered.insert(received.source) {
                    continue;
                }
                let line = dictionary.line(&received.payload);
                complete &= !line.is_error();
                output.line(match self.text {
                    true => {
                        let report = in_words(dictionary, &received.payload);
                        format!("{}  {report}", received.source)
                    }
                    false => answer(received.source, line)?,
                })?;
                if !self.address.has_wildcard() {
                    return Ok(Outcome::complete_if(complete));
                }
            }
        }
        if answered.is_empty() {
            say(self.silence());
        }
        Ok(Outcome::complete_if(complete && !answered.is_empty()))
    }

    fn send(&self, port: &Port, octets: Bytes) -> Result<(), Failure> {
        let outgoing = Outgoing::new(port.id(), self.address, octets);
        port.send(outgoing).map(drop).map_err(Failure::of)
    }

    /// Why there will be no answer, if this message is the component's list of services.
    fn not_offered(
        &self,
        received: &Received,
        query: &EncodedQuery,
        dictionary: &Dictionary,
    ) -> Option<String> {
        if received.source != self.address {
            return None;
        }
        let report = ReportServices::decode(&received.payload).ok()?;
        let code = u16::from_le_bytes(*query.octets.first_chunk()?);
        not_offered(dictionary, &report, self.address, code)
    }

    fn is_answer(&self, received: &Received, report: u16) -> bool {
        self.address.matches(received.source) && received.payload.starts_with(&report.to_le_bytes())
    }

    /// The message after a timeout.
    fn silence(&self) -> String {
        let (address, message) = (self.address, &self.message);
        let who = if address.has_wildcard() {
            format!("no component in {address} answered")
        } else {
            format!("{address} did not answer")
        };
        let waited = runtime::in_words(self.timeout);
        format!("{who} {message} within {waited}. {}", network::REMEDY)
    }
}

/// A report with its sender.
#[derive(Serialize)]
struct Answer<'d> {
    source: String,
    #[serde(flatten)]
    line: Line<'d>,
}

fn answer(source: JausId, line: Line<'_>) -> Result<String, Failure> {
    let source = source.to_string();
    serde_json::to_string(&Answer { source, line }).map_err(Failure::of)
}
