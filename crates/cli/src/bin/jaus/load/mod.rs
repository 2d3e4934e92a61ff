//! `jaus load`: measures round trips of acknowledged messages between many components on
//! several nodes, at increasing rates.

mod child;
mod components;
mod fleet;
mod latencies;
mod process;
mod report;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;
use jaus::node::Address;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{self, Output};
use jaus_cli::runtime;

pub(crate) use self::child::LoadChild;
use self::components::HEAD;
use self::fleet::Fleet;
pub(crate) use self::process::SUBCOMMAND;
use self::process::{Acknowledger, Run};
use self::report::{Report, Row};

/// Highest component number on a node.
const MOST_ON_NODE: u16 = 254;
/// Connections of one process, within the usual limit of 1024 open files.
const MOST_IN_PROCESS: u16 = 1000;

/// Measure round trips of acknowledged messages between many components
///
/// Starts nodes and component processes on this host. Each component has its own stream socket to
/// its node's process. It sends to the next component, on the next node, which acknowledges: a
/// message and its acknowledgement pass four processes each. The round trip ends when the sending
/// component has the acknowledgement. One row is one step of --rates. Uses loopback only. Exit
/// status 1 means that messages were lost or refused.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus load\n  \
    jaus load --rates 9000,max --for 10s --save load.json --svg load.svg\n  \
    jaus load --components 50 --attach     on a running `jaus-communicator --local`\n  \
    jaus load --beside socketio.json --svg both.svg\n\n\
    Columns: messages per second, offered and acknowledged; messages sent, lost (not acknowledged \
    within 2 s) and refused (by the sender's connection); round-trip times in milliseconds; CPU \
    time of all processes per acknowledged message in microseconds (Linux). Each row starts with \
    0.5 s of warm-up that is not counted.\n\n\
    Messages leave at ticks of one millisecond. The round trip starts when the tick is handled, \
    so messages of one tick wait for each other.")]
pub(crate) struct LoadCommand {
    /// The number of components, each with its own connection
    #[arg(long, value_name = "N", default_value = "1000", value_parser = clap::value_parser!(u16).range(2..=8000))]
    components: u16,

    /// The number of nodes for the components, one process each
    #[arg(long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u8).range(1..=32),
        conflicts_with = "attach")]
    nodes: u8,

    /// The number of processes for the components
    #[arg(long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u16).range(1..=64))]
    processes: u16,

    /// Messages per second of all components together, one row each; `max` is as fast as possible
    #[arg(
        long,
        value_name = "R,…",
        value_delimiter = ',',
        default_value = "100,1000,3000,9000,30000,100000,max"
    )]
    rates: Vec<Rate>,

    /// In a `max` row: the number of unacknowledged messages of each component
    #[arg(long, value_name = "N", default_value = "2", value_parser = clap::value_parser!(u32).range(1..=256))]
    window: u32,

    /// In a row with a rate: the number of messages a component sends at once
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=256))]
    burst: u32,

    /// How long to measure each row, at most an hour
    #[arg(long = "for", value_name = "DURATION", default_value = "5s", value_parser = row_time)]
    duration: Duration,

    /// The size of a message, such as 170 or 1kB, from 14 B to 1400 B
    #[arg(long, value_name = "SIZE", default_value = "170", value_parser = message_size)]
    size: u16,

    /// What acknowledges a message
    #[arg(long, value_name = "WHO", value_enum, default_value = "component")]
    acknowledged_by: Acknowledger,

    /// Attach to a running node of this host, such as a communicator, instead of starting nodes
    /// [ADDRESS defaults to the usual place]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "default")]
    attach: Option<Address>,

    /// Print JSON: an object with the settings, then one for each row
    #[arg(long)]
    json: bool,

    /// Write settings and rows into this file, for --beside
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,

    /// Draw the round trips into this file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,

    /// Show the rows of this file beside the measured ones: a file of --save, or of the Socket.IO
    /// relay in benches/socketio
    #[arg(long, value_name = "FILE")]
    beside: Option<PathBuf>,
}

/// A step of `--rates`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rate {
    PerSecond(u32),
    Max,
}

impl FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse() {
            _ if text == "max" => Ok(Self::Max),
            Ok(rate @ 1..=10_000_000) => Ok(Self::PerSecond(rate)),
            _ => Err("write a number from 1 to 10000000, or max".to_owned()),
        }
    }
}

fn message_size(text: &str) -> Result<u16, String> {
    let size = runtime::size_within(text, HEAD, 1400)?;
    // The bound fits.
    Ok(size as u16)
}

fn row_time(text: &str) -> Result<Duration, String> {
    let time = runtime::duration(text)?;
    let is_bounded = time <= Duration::from_secs(3600);
    is_bounded
        .then_some(time)
        .ok_or_else(|| "write at most one hour".to_owned())
}

impl LoadCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        self.check()?;
        let beside = self.beside.as_deref().map(Report::read).transpose()?;
        let mut report = Report {
            name: "JAUS".to_owned(),
            components: self.components,
            processes: self.processes,
            octets: self.size,
            window: self.window,
            burst: self.burst,
            seconds: self.duration.as_secs_f64(),
            rows: Vec::new(),
        };
        report.rows = self.measure(&report)?;
        let complete = report.rows.iter().all(|row| row.lost + row.refused == 0);
        if let Some(file) = &self.save {
            let text = serde_json::to_string_pretty(&report).map_err(Failure::of)?;
            std::fs::write(file, text + "\n").map_err(|error| Failure::file(file, &error))?;
        }
        if let (Some(beside), false) = (&beside, self.json) {
            let mut output = Output::new();
            output.line(format_args!("\n{}", beside.title()))?;
            output.line(Row::HEAD)?;
            beside.rows.iter().try_for_each(|row| output.line(row))?;
        }
        if let Some(file) = &self.svg {
            let plot = report.plot(beside.as_ref()).to_string();
            std::fs::write(file, plot).map_err(|error| Failure::file(file, &error))?;
        }
        Ok(Outcome::complete_if(complete))
    }

    fn check(&self) -> Result<(), Failure> {
        let nodes = if self.attach.is_some() { 1 } else { self.nodes };
        if self.components > MOST_ON_NODE * u16::from(nodes) {
            return Err(Failure::new(format!(
                "{} components need more than {nodes} nodes: a node holds at most {MOST_ON_NODE}",
                self.components
            )));
        }
        if self.components.div_ceil(self.processes) > MOST_IN_PROCESS {
            return Err(Failure::new(format!(
                "{} components need more than {} processes: a process has at most \
                 {MOST_IN_PROCESS} connections",
                self.components, self.processes
            )));
        }
        if self.processes > self.components {
            return Err(Failure::new(
                "more processes than components: lower --processes",
            ));
        }
        Ok(())
    }

    fn measure(&self, settings: &Report) -> Result<Vec<Row>, Failure> {
        let mut output = Output::new();
        let mut fleet = match &self.attach {
            Some(address) => Fleet::attach(std::slice::from_ref(address), self),
            None => Fleet::start(self),
        }?;
        if self.json {
            output.line(serde_json::to_string(settings).map_err(Failure::of)?)?;
        } else {
            self.print_settings(&mut output)?;
        }
        let mut rows = Vec::with_capacity(self.rates.len());
        for (number, &rate) in (1..).zip(&self.rates) {
            let run = |pace| Run {
                number,
                pace,
                burst: self.burst,
                time: self.duration,
                size: self.size.into(),
                acknowledged_by: self.acknowledged_by,
            };
            let row = fleet.measure(rate, self.window, run)?;
            match self.json {
                true => output.line(serde_json::to_string(&row).map_err(Failure::of)?)?,
                false => output.line(&row)?,
            }
            rows.push(row);
        }
        Ok(rows)
    }

    fn print_settings(&self, output: &mut Output) -> Result<(), Failure> {
        output.line(format_args!(
            "{} components in {} processes, {}; {} octets, bursts of {}, {} s for each row",
            self.components,
            self.processes,
            match &self.attach {
                Some(address) => format!("on the node at {address}"),
                None => format!("on {} nodes", self.nodes),
            },
            self.size,
            self.burst,
            self.duration.as_secs_f64()
        ))?;
        output.line(Row::HEAD)
    }
}

/// Prints progress on standard error.
fn progress(words: impl std::fmt::Display) {
    output::say(words);
}
