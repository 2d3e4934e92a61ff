//! `jaus judge`: runs the acceptance tests of the public JAUS contests against a component, and
//! explains failures.

mod hazard;
mod json;
mod judge_nodes;
mod junit;
mod memory;
mod outputs;
mod recording;
mod report;
mod runner;
mod script;
mod step;
mod subject;
mod verdict;
mod watch;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::Network;
use jaus_cli::output::{Output, say};
use jaus_cli::runtime;
use jsidl::Library;

use crate::definitions::Jsidl;
use judge_nodes::JudgeNodes;
use outputs::Outputs;
use recording::Recording;
use runner::Runner;
use script::service::Services;
use step::{Form, Name, Step};
use subject::Subject;
use verdict::StepResult;

/// The judge's main component, as in the contests; the others are 42.2.1 to 42.2.4.
const MAIN: JausId = JausId::new(42, 1, 1);

/// Judge whether a component meets the requirements of the public JAUS contests
///
/// Part A holds the six tasks of the 2010 challenge. Part B holds the 36 steps of the interface
/// tasks since 2014, as observed from their judging tool. Part C holds the judges' further checks:
/// the vehicle moves only for the client in control, and stops in standby, in an emergency and
/// after control is released. In part C efforts keep arriving 10 times a second, because an effort
/// that expires proves nothing. Five components of the judge query, subscribe, take control from
/// one another and declare emergencies; --id sets the first, and the other four, 1 to 4, are on the
/// next node. A step passes if the answers that the standard requires arrive within the time limit.
/// Steps that need a service which the component does not list are skipped and counted. Multicast
/// messages go to all components of the node.
///
/// THE JUDGE COMMANDS THE COMPONENT, AND A VEHICLE DRIVES: about 9 metres along its X axis in task
/// A6, and a few more in part C, which also checks that it stops.
///
/// Over a secure link (--secure-peer) the component's node has to trust this host's key for the
/// judge's ids, 42.255.255, with the right to do everything: `command control=255
/// clear-emergency=any configure also=any`.
///
/// Exit status 1 means that a step failed, that no step applied, or that there was no answer.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus judge 101.1.1\n  \
    jaus judge 101.1.1 --only B12-B26 --unicast\n  \
    jaus judge 152.1.1 --skip B8          for JAUS++, which does not survive it\n  \
    jaus judge 101.1.1 --peer 192.168.7.2 --junit judge.xml --record judge.pcapng\n  \
    jaus judge 101.1.1 --json | jq 'select(.verdict == \"failed\") | .step, .reason'")]
pub(crate) struct Judge {
    /// The component to judge: SUBSYSTEM.NODE.COMPONENT
    #[arg(required_unless_present = "list")]
    address: Option<JausId>,

    /// How long to wait for each answer
    #[arg(long, default_value = "1500ms", value_parser = runtime::duration)]
    timeout: Duration,

    /// Run only these steps and those they depend on, such as A1,B14-B19
    #[arg(long, value_name = "STEPS", value_delimiter = ',')]
    only: Vec<Span>,

    /// Leave out these steps and those that depend on them, such as B8, which JAUS++ does not survive
    ///
    /// They are reported as skipped. Before the first step the judge names the steps that end a
    /// component which it recognises.
    #[arg(long, value_name = "STEPS", value_delimiter = ',')]
    skip: Vec<Span>,

    /// Test this service, by URN or name, instead of the contests' steps (repeatable)
    ///
    /// The tests follow from the service's definition: each query is sent and its report checked; a
    /// truncated query must be ignored; each command that requires control is sent without control,
    /// must be ignored, and must leave the service's reports unchanged. For Access Control and
    /// Management every transition is tested too: in each state, each message about control and
    /// state, from the client in control and from another one, with the required answers and the
    /// state afterwards. Services that inherit from them share these states. Steps B3 to B10 test
    /// the transitions of Events.
    #[arg(long, value_name = "URN", conflicts_with_all = ["only", "skip"])]
    service: Vec<String>,

    /// Query by multicast only [default: first by multicast, then by unicast]
    #[arg(long, conflicts_with = "unicast")]
    multicast: bool,

    /// Query by unicast only, where multicast does not reach
    #[arg(long)]
    unicast: bool,

    #[command(flatten)]
    jsidl: Jsidl,

    /// Show the messages of passed steps too
    #[arg(long)]
    all: bool,

    /// List the steps and exit
    #[arg(long)]
    list: bool,

    /// Write one JSON line per step instead of the report, or with a FILE in addition to it
    #[arg(
        long,
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-",
    )]
    json: Option<PathBuf>,

    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,

    /// Record the messages to this file (pcapng, overwritten), with the step as each packet's
    /// comment
    ///
    /// The packets are rebuilt from the messages of the judge's components: sequence numbers differ
    /// from those on the wire.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,

    #[command(flatten)]
    network: Network,
}

/// A range of steps of one part: `B14-B19`, `A1`.
#[derive(Debug, Clone, Copy)]
struct Span {
    first: Name,
    last: Name,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let (first, last): (Name, Name) = (first.parse()?, last.parse()?);
        let is_there = |name| script::steps().iter().any(|step| step.name == name);
        for name in [first, last] {
            if !is_there(name) {
                return Err(format!(
                    "there is no step {name}; the steps are A1 to A6, B1 to B36 and C1 to C5"
                ));
            }
        }
        if first > last {
            return Err(format!("{first} comes after {last}: write {last}-{first}"));
        }
        Ok(Self { first, last })
    }
}

/// Whether a step is in any of these ranges.
fn is_in(spans: &[Span], name: Name) -> bool {
    let mut spans = spans.iter();
    spans.any(|span| (span.first..=span.last).contains(&name))
}

impl Judge {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let services = self.services()?;
        if self.list {
            return self.list(&services);
        }
        let Some(address) = self.address.filter(|address| address.is_unicast()) else {
            return Err(Failure::new(
                "the judge tests one component at a time: choose one that `jaus discover` lists",
            ));
        };
        runtime::run(self.judge(address, &services))
    }

    /// The services of `--service`.
    fn services(&self) -> Result<Services, Failure> {
        let library = match self.service.is_empty() {
            true => Library::default(),
            false => self.jsidl.services(),
        };
        Services::choose(library, &self.service)
            .map_err(|error| Failure::new(format!("--service: {error}")))
    }

    /// The selected steps.
    fn steps(&self, services: &Services, subject: Option<&Subject>) -> Vec<Step> {
        if !self.service.is_empty() {
            return services.steps(|urn| subject?.version(urn));
        }
        let chosen = |name| self.only.is_empty() || is_in(&self.only, name);
        script::selected(script::steps(), chosen)
    }

    fn forms(&self) -> Vec<Form> {
        let both = [
            (Form::Multicast, self.unicast),
            (Form::Unicast, self.multicast),
        ];
        let wanted = both.into_iter().filter(|&(_, unwanted)| !unwanted);
        wanted.map(|(form, _)| form).collect()
    }

    fn list(&self, services: &Services) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        for step in self.steps(services, None) {
            let names = step.needs.iter().filter_map(|urn| urn.rsplit(':').next());
            let needs = names.collect::<Vec<_>>().join(", ");
            output.line(format_args!("{:<3}  {}  ({needs})", step.name, step.title))?;
        }
        Ok(Outcome::Done)
    }

    async fn judge(&self, address: JausId, services: &Services) -> Result<Outcome, Failure> {
        self.network.require_dialling("jaus judge")?;
        let (id, config) = self.network.for_own_node_as(MAIN, "jaus judge")?;
        let recording = self.record.as_deref().map(Recording::create).transpose()?;
        let dictionary = self.jsidl.load()?;
        let mut outputs = Outputs::open(self, services, &dictionary)?;
        let mut judge_nodes =
            JudgeNodes::start(id, config, |it| self.network.start(it), address, recording)?;
        let Some(subject) = Subject::meet(&mut judge_nodes, address, self.timeout).await? else {
            judge_nodes.end().await?;
            say(format_args!(
                "{address} did not answer, so nothing was judged. List components with `jaus \
                 discover`, choose the network with --interface, or name a host that multicast \
                 does not reach with --peer"
            ));
            return Ok(Outcome::Incomplete);
        };
        outputs.begin(&subject)?;
        let mut runner = Runner::new(judge_nodes, &subject, self.timeout);
        let end = runtime::end(None);
        tokio::pin!(end);
        let finished = tokio::select! {
            () = &mut end => false,
            result = self.carry_out(services, &mut runner, &subject, &mut outputs) => { result?; true }
        };
        if !finished {
            runner.tidy().await?;
        }
        runner.end().await?;
        let conforms = outputs.end(&subject)?;
        Ok(Outcome::complete_if(conforms && finished))
    }

    /// Runs all steps in all forms.
    async fn carry_out(
        &self,
        services: &Services,
        runner: &mut Runner,
        subject: &Subject,
        outputs: &mut Outputs<'_>,
    ) -> Result<(), Failure> {
        let steps = self.steps(services, Some(subject));
        let left_out = script::left_out(&steps, |name| is_in(&self.skip, name));
        let to_run = steps.iter().filter(|it| !left_out.contains_key(&it.name));
        if let Some(warning) = hazard::warning(subject, to_run) {
            say(format_args!("warning: {warning}"));
        }
        for form in self.forms() {
            outputs.form(form)?;
            runner.begin(form);
            for step in &steps {
                if step.by_unicast_only && form == Form::Multicast {
                    continue;
                }
                outputs.step_begins(step)?;
                let result = match left_out.get(&step.name) {
                    Some(reason) => StepResult::left_out(step, form, reason),
                    None => runner.carry_out(step, form, subject).await?,
                };
                outputs.step_ends(result)?;
            }
            runner.tidy().await?;
        }
        Ok(())
    }
}
