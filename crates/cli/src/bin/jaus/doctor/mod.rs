//! `jaus doctor`: checks everything that keeps nodes from finding each other, and suggests
//! remedies. One file per check; a check returns [`Finding`]s. With `--peer` it examines one peer
//! instead: see [`peer`].

mod finding;
mod host;
mod neighbours;
mod peer;
mod port;
mod ra;

use std::time::Duration;

use clap::Args;
use serde_json::json;

use self::finding::{Finding, Mark};
use self::peer::{Options, Target};
use jaus::node::Config;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::Network;
use jaus_cli::output::{Output, colours_wanted, counted, say};
use jaus_cli::runtime;

/// Find out why nodes do not find each other
///
/// Checks this host's interfaces, port, buffers and clock, then listens on the network: does
/// multicast loop back, which nodes are there, do two of them share an id? Needs no privileges.
/// Give it the flags or the settings file of the node that does not work. Exit status: 0 all is
/// well, 1 there are warnings, 2 there are problems.
///
/// With --peer it examines one peer: it recognises the stack and tries each exchange in the order
/// in which integrations fail. It sends no commands. Exit status: 0 all exchanges passed, 1 some
/// failed, 2 no exchange is possible.
#[derive(Args)]
#[command(mut_arg("peer", |peer| peer.long("unicast")))]
#[command(after_help = "Examples:\n  \
    jaus doctor\n  \
    jaus doctor --config node.toml        with the settings of a node\n  \
    jaus doctor --id 101.1.1              and whether that id is taken\n  \
    jaus doctor --interface eth0 --for 10s\n  \
    jaus doctor --peer 192.168.7.2        tests the exchanges with that peer\n  \
    jaus doctor --peer 77.1.1             the same, found by its id\n  \
    jaus doctor --json | jq '.findings[] | select(.mark != \"ok\")'")]
pub(crate) struct Doctor {
    /// Examine this peer: an id (77.1.1), an address (192.168.7.2 or 192.168.7.2:3795), or both
    /// (77.1.1@192.168.7.2)
    // The network's flag for peers has this one's usual id.
    #[arg(id = "examined", long = "peer", value_name = "ADDRESS")]
    examined: Option<Target>,

    /// Take control of the peer and release it, unless another client has control
    #[arg(long, requires = "examined")]
    control: bool,

    /// How long to listen to the network [default: 3s; with --peer 6s at most]
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration)]
    duration: Option<Duration>,

    /// Print the findings as one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    network: Network,
}

/// Default listening time.
const LISTEN: Duration = Duration::from_secs(3);

impl Doctor {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if let Some(target) = self.examined {
            let (id, config) = self.network.for_examination()?;
            let options = Options {
                target,
                listen: self.duration,
                control: self.control,
                json: self.json,
                colours: colours_wanted(&std::io::stdout()),
            };
            return runtime::run(peer::examine(options, id, config));
        }
        let mut report = Report {
            output: Output::new(),
            colours: colours_wanted(&std::io::stdout()),
            json: self.json,
            findings: Vec::new(),
        };
        runtime::run(self.examine(&mut report))?;
        report.close()
    }

    async fn examine(&self, report: &mut Report) -> Result<(), Failure> {
        let (id, config) = match self.network.for_examination() {
            Ok(settings) => settings,
            Err(failure) => {
                let advice = "correct it: doctor cannot check anything else before";
                return report.add(Finding::problem("settings", failure).advice(advice));
            }
        };
        if self.network.has_file() {
            report.add(Finding::ok("settings", "the settings file can be read"))?;
        }
        report.add_all(ways(&config))?;
        report.add_all(port::check_tcp(&config))?;
        let listen = self.duration.unwrap_or(LISTEN);
        if !self.json {
            let seconds = listen.as_secs_f64();
            say(format_args!("listening on the network for {seconds} s …"));
        }
        let clock = host::ClockWatch::start();
        report.add_all(neighbours::look(config, id, listen).await)?;
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
    let ports = interfaces.iter().flat_map(|it| port::check(config, it));
    findings.extend(ports);
    findings
}

/// Findings so far; printed at once, or at the end as JSON.
struct Report {
    output: Output,
    colours: bool,
    json: bool,
    findings: Vec<Finding>,
}

impl Report {
    fn add(&mut self, finding: Finding) -> Result<(), Failure> {
        if !self.json {
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
        let count = |mark| self.findings.iter().filter(|f| f.mark == mark).count();
        let (problems, warnings) = (count(Mark::Problem), count(Mark::Warning));
        if self.json {
            let findings: Vec<_> = self.findings.iter().map(Finding::to_json).collect();
            self.output.line(json!({
                "problems": problems,
                "warnings": warnings,
                "findings": findings,
            }))?;
        } else {
            self.output.line(match (problems, warnings) {
                (0, 0) => "\nAll is well.".to_owned(),
                _ => format!(
                    "\n{}, {}.",
                    counted(problems, "problem"),
                    counted(warnings, "warning")
                ),
            })?;
        }
        Ok(match (problems, warnings) {
            (0, 0) => Outcome::Done,
            (0, _) => Outcome::Incomplete,
            _ => Outcome::Broken,
        })
    }
}
