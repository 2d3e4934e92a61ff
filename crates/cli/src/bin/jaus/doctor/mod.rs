//! `jaus doctor`: checks everything that keeps nodes from finding each other, and suggests
//! remedies. One file per check; a check returns [`Finding`]s. [`examine`](crate::examine) examines
//! one peer.
#![expect(
    clippy::disallowed_methods,
    reason = "pauses between rounds in real time"
)]

mod finding;
mod group;
mod heard;
mod host;
mod neighbours;
mod network;
mod port;
mod ra;
#[cfg(feature = "secure")]
mod secure;
mod watch;

use std::time::Duration;

use clap::Args;
use serde_json::json;

use self::finding::{Finding, Mark};
use self::watch::Rounds;
use jaus::address::JausId;
use jaus::node::Config;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{Network, passing_id};
use jaus_cli::output::{Output, colours_wanted, counted, say};
use jaus_cli::runtime::{self, Clock};

/// Find out why nodes do not find each other
///
/// Checks this host's interfaces, port, buffers and clock, then listens on the network: does
/// multicast loop back, which nodes are there, do their multicasts arrive, do two of them share an
/// id? With a secure link it checks keys and trusted keys, and connects to the peers. Needs no
/// privileges. Give it the flags or the settings file of the node that does not work.
/// Exit status 1 means that there are warnings or failures, for instance that no other node was
/// heard. `jaus examine` examines one peer.
///
/// With --watch it repeats all checks until Ctrl-C or SIGTERM, and prints the findings of the first
/// round, then only differences. The exit status is that of the last complete round, and 1 if there
/// was none.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus doctor\n  \
    jaus doctor --config node.toml        with the settings of a node\n  \
    jaus doctor --id 101.1.1              and whether that id is taken\n  \
    jaus doctor --interface eth0 --for 10s\n  \
    jaus doctor --secure-peer 192.168.7.2 and whether a secure link stands\n  \
    jaus doctor --json | jq '.findings[] | select(.verdict != \"ok\")'\n  \
    jaus doctor --watch                   repeats the checks, prints differences\n\n\
    With --watch, --json prints an object a line: \"event\" (\"new\" or \"over\"), \"seconds\" since \
    the start, and the finding.")]
pub(crate) struct Doctor {
    /// How long to listen to the network; up to 30s if a node is there whose multicasts do not arrive
    #[arg(long = "for", value_name = "DURATION", default_value = "3s", value_parser = runtime::duration)]
    duration: Duration,

    /// Repeat the checks after this pause until Ctrl-C, and print only differences [pause without a
    /// value: 10s]
    #[arg(
        long,
        value_name = "PAUSE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "10s",
        value_parser = runtime::duration,
    )]
    watch: Option<Duration>,

    /// Print the findings as one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    network: Network,
}

impl Doctor {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if let Some(pause) = self.watch {
            return runtime::run(self.watch(pause));
        }
        let mut report = Report::new(self.json, true);
        runtime::run(self.examine(passing_id(), &mut report))?;
        report.close()
    }

    /// Repeats the checks until a signal.
    async fn watch(&self, pause: Duration) -> Result<Outcome, Failure> {
        let clock = Clock::start();
        let mut output = Output::new();
        let mut rounds = Rounds::default();
        let mut outcome = Outcome::Incomplete;
        // With one id for all rounds it stays one entry in the tables of its peers.
        let own = passing_id();
        let end = runtime::end(None);
        tokio::pin!(end);
        loop {
            let mut report = Report::new(self.json, false);
            tokio::select! {
                () = &mut end => return Ok(outcome),
                examined = self.examine(own, &mut report) => examined?,
            }
            outcome = report.outcome();
            let colours = report.colours;
            for difference in rounds.handle_round(report.findings) {
                if self.json {
                    output.line(difference.to_json(clock.elapsed()))?;
                } else {
                    output.line(format_args!("{clock}  {}", difference.in_words(colours)))?;
                }
            }
            tokio::select! {
                () = &mut end => return Ok(outcome),
                () = tokio::time::sleep(pause) => {}
            }
        }
    }

    async fn examine(&self, own: JausId, report: &mut Report) -> Result<(), Failure> {
        let (id, config) = self.network.for_examination(own)?;
        if self.network.has_file() {
            report.add(Finding::ok("settings", "the settings file can be read"))?;
        }
        #[cfg(feature = "secure")]
        let config = match self.network.secure()? {
            Some(link) => {
                let node = JausId::new(config.subsystem, config.node, 0);
                report.add_all(secure::check(&link, node, self.duration).await)?;
                match secure::plain(config) {
                    Ok(Some(config)) => config,
                    Ok(None) => return Ok(()),
                    Err(contradiction) => return report.add(contradiction),
                }
            }
            None => config,
        };
        report.add_all(ways(&config))?;
        report.add_all(port::check_tcp(&config))?;
        let listen = self.duration;
        if !self.json && self.watch.is_none() {
            let seconds = listen.as_secs_f64();
            say(format_args!("listening on the network for {seconds} s …"));
        }
        let clock = host::ClockWatch::start();
        let heard = network::look(config, id, listen, &report.findings).await;
        report.add_all(heard)?;
        report.add(clock.finish())
    }
}

/// Checks the paths to the network: interfaces and ports, or Junior.
fn ways(config: &Config) -> Vec<Finding> {
    #[cfg(unix)]
    if let Some(folder) = &config.junior {
        return vec![port::check_junior(folder)];
    }
    let (interfaces, mut findings) = host::interfaces(config);
    findings.splice(0..0, host::buffers(config));
    findings.extend(port::check(config, &interfaces));
    findings
}

/// Findings so far; printed at once, or at the end as JSON.
struct Report {
    output: Output,
    colours: bool,
    json: bool,
    /// Whether findings are printed as they are added.
    is_live: bool,
    findings: Vec<Finding>,
}

impl Report {
    fn new(json: bool, prints: bool) -> Self {
        Self {
            output: Output::new(),
            colours: colours_wanted(&std::io::stdout()),
            json,
            is_live: prints && !json,
            findings: Vec::new(),
        }
    }

    fn add(&mut self, finding: Finding) -> Result<(), Failure> {
        if self.is_live {
            self.output.line(finding.in_words(self.colours))?;
        }
        self.findings.push(finding);
        Ok(())
    }

    fn add_all(&mut self, findings: impl IntoIterator<Item = Finding>) -> Result<(), Failure> {
        findings
            .into_iter()
            .try_for_each(|finding| self.add(finding))
    }

    fn close(mut self) -> Result<Outcome, Failure> {
        let conclusion = self.conclusion();
        let (problems, warnings) = self.counts();
        if self.json {
            let findings: Vec<_> = self.findings.iter().map(Finding::to_json).collect();
            self.output.line(json!({
                "failures": problems,
                "warnings": warnings,
                "conclusion": conclusion,
                "findings": findings,
            }))?;
        } else {
            self.output.line(format_args!("\n{conclusion}"))?;
        }
        Ok(self.outcome())
    }

    fn outcome(&self) -> Outcome {
        Outcome::complete_if(self.counts() == (0, 0))
    }

    fn count(&self, mark: Mark) -> usize {
        self.findings.iter().filter(|it| it.mark == mark).count()
    }

    /// The number of failures and of warnings.
    fn counts(&self) -> (usize, usize) {
        let warnings = self.count(Mark::Warning) + self.count(Mark::Alone);
        (self.count(Mark::Problem), warnings)
    }

    fn conclusion(&self) -> String {
        match self.counts() {
            (0, 0) => "All is well.".to_owned(),
            (0, 1) if self.count(Mark::Alone) == 1 => {
                "This host is sound, but no other node was heard.".to_owned()
            }
            (problems, warnings) => format!(
                "{}, {}.",
                counted(problems, "failure"),
                counted(warnings, "warning")
            ),
        }
    }
}
