//! `jaus test`: a mission through all components, checked step by step.
#![expect(
    clippy::disallowed_methods,
    reason = "traffic is printed with the time since the start"
)]

use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use clap::Args;
use jaus::component::{Component, Kind};
use jaus::node::{Tap, Tapped};
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::Network;
use jaus_cli::runtime;
use jaus_vehicle::parts::tester::{MissionTest, figure, steps};
use serde_json::{Value as Json, json};
use tokio::sync::mpsc;

use crate::events::{EventFormat, EventPrinter};

/// Drive a mission through all components of a vehicle and check each answer
///
/// Finds planner, knowledge store, sensors and drivers of a subsystem, takes control of the
/// planner, sets a destination, approves the path, checks that the stages start in order, and
/// checks where the vehicle stops. Each message to or from the tester is printed as a line. Exit
/// status 1 means that a step has failed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus test --loopback                 the vehicle 101 on this computer\n  \
    jaus test 101 --to 4,-2.5 --junit mission.xml\n  \
    jaus test 105 --quiet                only the steps\n\n\
    Events of --json: \"message\" with \"source\", \"destination\", \"code\", \"name\" and \"sequence\"; \
    \"step\" with \"name\", \"verdict\" (ok, failed, skipped), \"detail\" and \"ms\"; \"end\" with the \
    numbers of \"steps\" and of those that \"passed\".")]
pub(crate) struct TestCommand {
    /// The vehicle's subsystem
    #[arg(default_value = "101", value_parser = clap::value_parser!(u16).range(1..=65534))]
    subsystem: u16,

    /// The destination X,Y in the local frame in metres [default: about four metres away]
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    to: Option<(f64, f64)>,

    /// The greatest speed in m/s
    #[arg(long, value_name = "M/S", default_value = "1", value_parser = speed)]
    speed: f32,

    /// The authority used to control the planner, from 0 to 255
    #[arg(long, default_value = "200")]
    authority: u8,

    /// How long to wait for a step, except the drive
    #[arg(long, default_value = "15s", value_parser = runtime::duration)]
    timeout: Duration,

    /// How long to wait for the end of the drive
    #[arg(long, value_name = "DURATION", default_value = "2min", value_parser = runtime::duration)]
    drive_timeout: Duration,

    /// Write the steps to this file as a JUnit report
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,

    /// Do not show messages
    #[arg(long)]
    quiet: bool,

    /// Show messages of discovery and event renewal too
    #[arg(long, conflicts_with = "quiet")]
    all: bool,

    #[command(flatten)]
    format: EventFormat,

    #[command(flatten)]
    network: Network,
}

/// Maximum number of messages queued for display.
const WAITING: usize = 4096;

impl TestCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let steps = runtime::run(self.drive())?;
        if let Some(file) = &self.junit {
            let report = steps::junit("jaus test", &steps);
            std::fs::write(file, report).map_err(|error| Failure::file(file, &error))?;
        }
        Ok(Outcome::complete_if(steps::all_pass(&steps)))
    }

    async fn drive(&self) -> Result<Vec<steps::Step>, Failure> {
        let (port, stay) = self.network.join_for_a_moment().await?;
        let begin = SystemTime::now();
        let mut printer = self.format.printer();
        let node = stay.node();
        let tap = node.as_ref().filter(|_| !self.quiet);
        let mut tap = tap.map(|node| node.tap(WAITING));
        if tap.is_none() && !self.quiet {
            printer.words(
                "the messages pass through another process's node: see them with `jaus watch`",
            )?;
        }
        let tester = Component::builder(Kind::OperatorControlUnit, "Tester");
        let tester = tester.live_on(port).map_err(Failure::of)?;
        printer.words(format_args!(
            "{} tests subsystem {}",
            tester.id(),
            self.subsystem
        ))?;
        let (tell, mut told) = mpsc::unbounded_channel();
        let test = MissionTest {
            subsystem: self.subsystem,
            to: self.to,
            speed: self.speed,
            authority: self.authority,
            patience: self.timeout,
            drive: self.drive_timeout,
        };
        let until = runtime::end(None);
        tokio::pin!(until);
        let steps = {
            // The test reports a bounded number of steps.
            let running = test.run(&tester, |step| _ = tell.send(step.clone()));
            tokio::pin!(running);
            loop {
                tokio::select! {
                    biased;
                    Some(tapped) = next(&mut tap) => self.show(&tapped, begin, &mut printer)?,
                    Some(step) = told.recv() => print_step(&step, &mut printer)?,
                    steps = &mut running => break steps,
                    () = &mut until => return Err(Failure::new("interrupted before the last step")),
                }
            }
        };
        while let Ok(step) = told.try_recv() {
            print_step(&step, &mut printer)?;
        }
        let passed = steps
            .iter()
            .filter(|step| matches!(step.verdict, steps::Verdict::Pass(_)));
        let (passed, all) = (passed.count(), steps.len());
        printer.plain(
            "end",
            json!({ "passed": passed, "steps": all }),
            format_args!("{passed} of {all} steps passed"),
        )?;
        drop(tester);
        stay.end().await;
        Ok(steps)
    }

    fn show(
        &self,
        tapped: &Tapped,
        begin: SystemTime,
        printer: &mut EventPrinter,
    ) -> Result<(), Failure> {
        match tapped {
            Tapped::Lost(count) => printer.plain(
                "lost",
                json!({ "messages": count }),
                format_args!("{count} messages were not shown"),
            ),
            Tapped::Passage(passage) => {
                let lines = figure::lines(passage, begin).into_iter();
                let mut lines = lines.filter(|line| self.all || !line.is_chatter());
                lines.try_for_each(|line| printer.plain("message", message_json(&line), &line))
            }
        }
    }
}

fn message_json(line: &figure::Line) -> Json {
    json!({
        "source": line.source.to_string(),
        "destination": line.destination.to_string(),
        "code": format!("{:04X}", line.code),
        "name": line.name,
        "sequence": line.sequence,
    })
}

fn print_step(step: &steps::Step, printer: &mut EventPrinter) -> Result<(), Failure> {
    let (verdict, detail) = match &step.verdict {
        steps::Verdict::Pass(detail) => ("ok", detail.as_str()),
        steps::Verdict::Fail(detail) => ("failed", detail.as_str()),
        steps::Verdict::Skipped => ("skipped", ""),
    };
    let ms = (step.took.as_secs_f64() * 1e6).round() / 1e3;
    let details = json!({ "name": step.name, "verdict": verdict, "detail": detail, "ms": ms });
    printer.plain("step", details, step)
}

async fn next(tap: &mut Option<Tap>) -> Option<Tapped> {
    match tap {
        Some(tap) => tap.next().await,
        None => None,
    }
}

/// Parses a place in the local frame: `4,-2.5`.
fn point(text: &str) -> Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
    let pair = text
        .split_once(',')
        .and_then(|(x, y)| Some((number(x)?, number(y)?)));
    pair.ok_or_else(|| "write X and Y in metres such as 4,-2.5".to_owned())
}

/// Parses a speed.
fn speed(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(speed) if (0.01..=100.0).contains(&speed) => Ok(speed),
        _ => Err("write a speed from 0.01 to 100 m/s".to_owned()),
    }
}
