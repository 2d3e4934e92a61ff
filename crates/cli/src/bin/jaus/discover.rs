//! `jaus discover`: prints subsystems, nodes, components and services.

use std::io::stdout;
use std::time::Duration;

use clap::Args;
use jaus::component::Component;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::Network;
use jaus_cli::output::{Output, colours_wanted, say};
use jaus_cli::runtime::{self, Clock};
use jaus_cli::tree;

/// Show subsystems, nodes, components and their services
///
/// Searches for a few seconds and prints the tree of what it found. Exit status 1 means that
/// nothing was found.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus discover\n  \
    jaus discover --watch\n  \
    jaus discover --interface eth0 --for 10s --json | jq\n  \
    jaus discover --peer 192.168.7.2      for a host that multicast does not reach\n  \
    jaus discover --attach                as a component on this host's node\n  \
    jaus discover --loopback              finds `jaus demo` in another terminal")]
pub(crate) struct Discover {
    /// Keep running and print arrivals, changes and losses, until Ctrl-C
    #[arg(long)]
    watch: bool,

    /// Print JSON: the tree as one object, or with --watch one object for each change
    #[arg(long)]
    json: bool,

    /// How long to search [default: 3s; with --watch until Ctrl-C]
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration)]
    duration: Option<Duration>,

    #[command(flatten)]
    network: Network,
}

/// Default duration.
const LOOK: Duration = Duration::from_secs(3);

impl Discover {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let joined = self.network.component_for_a_moment("jaus discover");
            let (component, _, stay) = joined.await?;
            let outcome = if self.watch {
                self.watch(&component).await
            } else {
                runtime::end(Some(self.duration.unwrap_or(LOOK))).await;
                self.print_tree(&component)
            };
            drop(component);
            stay.end().await;
            outcome
        })
    }

    fn print_tree(&self, component: &Component) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        let directory = component.directory();
        let lines = tree::lines(&directory, Some(component.id()), colours_wanted(&stdout()));
        if self.json {
            output.line(tree::json(&directory, component.id()))?;
        } else {
            lines.iter().try_for_each(|line| output.line(line))?;
        }
        if lines.is_empty() {
            let searched = runtime::in_words(self.duration.unwrap_or(LOOK));
            say(format_args!(
                "no answer within {searched}. Choose the network with --interface, name a host \
                 that multicast does not reach with --peer, or search longer with --for; `jaus \
                 doctor` finds out what is wrong"
            ));
        }
        Ok(Outcome::complete_if(!lines.is_empty()))
    }

    async fn watch(&self, component: &Component) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        let mut changes = component.watch();
        let end = runtime::end(self.duration);
        tokio::pin!(end);
        let clock = Clock::start();
        loop {
            let change = tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                change = changes.next() => change,
            };
            let Some(change) = change else {
                return Err(Failure::new("the node has stopped"));
            };
            let directory = component.directory();
            if self.json {
                output.line(tree::change_json(change, &directory))?;
            } else if let Some(words) = tree::in_words(change, &directory) {
                output.line(format_args!("{clock}  {words}"))?;
            }
        }
    }
}
