//! `jaus subscribe`: prints the reports of subscriptions as they arrive.

mod rate;
mod sampled;
mod topic;

use clap::Args;
use futures_util::future::select_all;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, PeerClocks, SubscribeError, Undecoded, Update, When};
use jaus::messages::core::CreateEvent;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::say;
use jaus_cli::runtime::{self, RunFor, between};
use jaus_view::{Dictionary, EncodedQuery};

use self::topic::{Printer, Topic};
use crate::definitions::Definitions;
use crate::offers::ask_if_not_offered;
use crate::queries::{Fields, Named};

/// Subscribe to reports of a component and print each as it arrives
///
/// Creates an event for each query and renews it until the end, also after the component was lost.
/// Then prints the number of reports, their rate, their loss, and the age of the last one. Exit
/// status 1 means that a subscription was refused, or that no report arrived.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus subscribe 101.1.33 QueryVelocityState\n  \
    jaus subscribe 101.1.33 QueryVelocityState --hz 10 --fields Velocity_X,Yaw_Rate\n  \
    jaus subscribe 101.1.34 QueryLocalPose QueryStatus --on-change --for 1min\n  \
    jaus subscribe 101.1.34 QueryLocalPose --hz 5 --json | jq .body.X\n\n\
    With --json each line is an object: a report as of `jaus query`, with the measured rate \
    (\"hz\"), its age in seconds (\"age\") and the number of lost reports (\"lost\"), with --clock \
    the age of its sample (\"sampled\"); or an \"event\": \"up\", \"down\" or \"end\".")]
pub(crate) struct Subscribe {
    /// The component that reports: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID", value_parser = network::one_component)]
    address: JausId,

    /// The queries whose answers are the reports, by name; each may be followed by its fields as
    /// JSON
    #[arg(required = true, value_name = "QUERY")]
    queries: Vec<String>,

    /// The rate of the reports in hertz, from 0.02 to 1092
    #[arg(long, default_value = "1", value_parser = |text: &str| between(text, 0.02, 1092.0))]
    hz: f64,

    /// Get a report at each change instead of periodically
    #[arg(long, conflicts_with = "hz")]
    on_change: bool,

    #[command(flatten)]
    fields: Fields,

    #[command(flatten)]
    run_for: RunFor,

    /// Measure the clock of the component, which must offer the Time service, and print how long
    /// ago samples with a time stamp were taken
    #[arg(long)]
    clock: bool,

    /// Print JSON, one object for each report
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    definitions: Definitions,

    #[command(flatten)]
    network: Network,
}

impl Subscribe {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let dictionary = self.definitions.load()?;
        let queries = Named::all(&self.queries)?;
        let queries = self.fields.encode(&dictionary, &queries)?;
        runtime::run(async {
            let joined = self.network.component_for_a_moment("jaus subscribe");
            let (component, _, stay) = joined.await?;
            let clocks = PeerClocks::default();
            let outcome = tokio::select! {
                outcome = self.follow(&component, queries, &dictionary, &clocks) => outcome,
                never = clocks.measure(&component), if self.clock => match never {},
            };
            drop(component);
            stay.end().await;
            outcome
        })
    }

    /// Subscribes, and prints until the end.
    async fn follow(
        &self,
        component: &Component,
        queries: Vec<EncodedQuery>,
        dictionary: &Dictionary,
        clocks: &PeerClocks,
    ) -> Result<Outcome, Failure> {
        let end = self.run_for.end();
        tokio::pin!(end);
        let clocks = self.clock.then(|| clocks.clone());
        let mut printer = Printer::new(self.json, dictionary, clocks);
        let subscribed = tokio::select! {
            () = &mut end => {
                say(format_args!("{} has confirmed no subscription. {}", self.address, network::REMEDY));
                return Ok(Outcome::Incomplete);
            }
            subscribed = self.subscribe(component, queries, dictionary) => subscribed?,
        };
        let Some(mut topics) = subscribed else {
            return Ok(Outcome::Incomplete);
        };
        loop {
            let next = select_all(topics.iter_mut().map(|topic| Box::pin(topic.next())));
            let (update, place) = tokio::select! {
                () = &mut end => break,
                (update, place, _) = next => (update, place),
            };
            let topic = &mut topics[place];
            match update {
                Some(Update::Report(Undecoded(octets))) => printer.report(topic, &octets)?,
                Some(Update::Up) => printer.up(topic)?,
                Some(Update::Down { why, .. }) => printer.down(topic, &why)?,
                None => {
                    printer.ended(topic)?;
                    return Ok(Outcome::Incomplete);
                }
            }
        }
        topics.iter().try_for_each(|topic| printer.summary(topic))?;
        let is_complete = topics.iter().all(Topic::has_reports);
        Ok(Outcome::complete_if(is_complete))
    }

    /// Creates the events. `None`, with a message, if one is refused.
    async fn subscribe(
        &self,
        component: &Component,
        queries: Vec<EncodedQuery>,
        dictionary: &Dictionary,
    ) -> Result<Option<Vec<Topic>>, Failure> {
        let mut topics = Vec::new();
        for query in queries {
            let code = query.octets.first_chunk();
            let code = code.map_or(0, |&code| u16::from_le_bytes(code));
            let wanted = jaus::service::Topic {
                peer: self.address,
                query: query.octets,
                report: query.report,
                when: match self.on_change {
                    true => When::OnChange,
                    false => When::hz(self.hz),
                },
            };
            match component.subscribe_undecoded(wanted).await {
                Ok(subscription) => topics.push(Topic::new(query.name, subscription)),
                Err(SubscribeError::Ended { why, .. }) => {
                    let (name, peer) = (query.name, self.address);
                    say(format_args!("no subscription to {name} of {peer}: {why}"));
                    let codes = [code, CreateEvent::CODE];
                    let not_offered = ask_if_not_offered(component, dictionary, peer, &codes);
                    not_offered.await.iter().for_each(say);
                    return Ok(None);
                }
                Err(error) => return Err(Failure::of(error)),
            }
        }
        Ok(Some(topics))
    }
}
