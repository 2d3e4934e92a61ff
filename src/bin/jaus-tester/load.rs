//! `jaus-tester load`: how long messages take through one communicator, under load.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use jaus::cli::failure::{Failure, Outcome};
use jaus::cli::output::Output;
use jaus::cli::runtime;
use jaus::node::{Address, Config, Host, Node};
use jaus::parts::tester::load::{self, Load};
use jaus::parts::tester::plot::{Line, Plot};
use tokio::sync::oneshot;

/// Measure how long messages take through one communicator
///
/// So many components attach to one node, each over a connection of its own as a process would, and
/// each sends so many messages in a second to the next one. Without --attach the node is one of its
/// own, on a thread of its own. Exit status 1 means that messages were lost.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus-tester load\n  \
    jaus-tester load --components 2,10,50,100 --rate 200 --seconds 10 --svg load.svg\n  \
    jaus-tester load --components 50 --attach     through a running `jaus-communicator --local`\n\n\
    Columns: latencies in microseconds from the call that sends a message to the task that has it.")]
pub(crate) struct LoadCommand {
    /// How many components send to each other, from 2 to 254; several numbers give several rows
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "2,5,10,20,50,100",
        value_parser = clap::value_parser!(u8).range(2..=254))]
    components: Vec<u8>,

    /// How many messages each of them sends in a second
    #[arg(long, value_name = "M", default_value = "100", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    rate: u32,

    /// For how long each row is measured
    #[arg(long, default_value = "5", value_parser = runtime::seconds)]
    seconds: Duration,

    /// Octets of a message, from 10 to 1400
    #[arg(long, value_name = "OCTETS", default_value = "64", value_parser = clap::value_parser!(u16).range(10..=1400))]
    size: u16,

    /// The communicator: the node of this host that serves components [default: one of its own;
    /// without ADDRESS the usual place]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "default")]
    attach: Option<Address>,

    /// Draw the figures into this file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

impl LoadCommand {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let own = match self.attach {
            Some(_) => None,
            None => Some(Communicator::start()?),
        };
        let address = match (&self.attach, &own) {
            (Some(address), _) => address.clone(),
            (None, Some(own)) => own.address.clone(),
            (None, None) => Address::Default,
        };
        let outcomes = runtime::run(self.measure(&Host::at(address).name("jaus-tester")))?;
        if let Some(file) = &self.svg {
            let plot = self.plot(&outcomes).to_string();
            std::fs::write(file, plot).map_err(|error| Failure::file(file, &error))?;
        }
        let complete = outcomes
            .iter()
            .all(|it| it.outcome.lost() + it.outcome.refused == 0);
        Ok(Outcome::complete_if(complete))
    }

    async fn measure(&self, communicator: &Host) -> Result<Vec<Row>, Failure> {
        let mut output = Output::new();
        output.line(format_args!(
            "{} messages/s from each component, {} octets, {} s for each row",
            self.rate,
            self.size,
            self.seconds.as_secs_f64()
        ))?;
        output.line(
            "| components | messages/s | sent | lost | refused | mean µs | p50 µs | p99 µs | p99.9 µs | \
             max µs |\n|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        )?;
        let mut rows = Vec::new();
        for &components in &self.components {
            let load = Load {
                components,
                rate: self.rate,
                time: self.seconds,
                size: self.size.into(),
            };
            let row = Row::of(load.run(communicator).await.map_err(Failure::of)?);
            output.line(&row)?;
            rows.push(row);
        }
        Ok(rows)
    }

    fn plot(&self, rows: &[Row]) -> Plot {
        let line = |name: &str, figure: fn(&Row) -> f64| Line {
            name: name.to_owned(),
            points: rows
                .iter()
                .map(|row| (f64::from(row.outcome.load.components), figure(row)))
                .collect(),
        };
        Plot {
            title: format!(
                "One communicator: {} messages/s from each component, {} octets",
                self.rate, self.size
            ),
            across: "components".to_owned(),
            up: "latency in microseconds".to_owned(),
            lines: vec![
                line("p99.9", |row| row.figures[3]),
                line("p99", |row| row.figures[2]),
                line("mean", |row| row.figures[0]),
                line("p50", |row| row.figures[1]),
            ],
        }
    }
}

/// One row of the table.
struct Row {
    outcome: load::Outcome,
    /// Mean, p50, p99, p99.9 and the greatest, in microseconds.
    figures: [f64; 5],
}

impl Row {
    fn of(mut outcome: load::Outcome) -> Self {
        let micros = |time: Duration| time.as_secs_f64() * 1e6;
        let latencies = &mut outcome.latencies;
        let mean = micros(latencies.mean());
        let [p50, p99, p999, most] =
            [0.5, 0.99, 0.999, 1.0].map(|share| micros(latencies.within(share)));
        Self {
            outcome,
            figures: [mean, p50, p99, p999, most],
        }
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { outcome, figures } = self;
        write!(
            f,
            "| {:>3} | {:>8.0} | {:>8} | {:>3} | {:>3} |",
            outcome.load.components,
            outcome.per_second(),
            outcome.sent,
            outcome.lost(),
            outcome.refused
        )?;
        figures
            .iter()
            .try_for_each(|figure| write!(f, " {figure:>7.1} |"))
    }
}

/// A node for the load, on a thread of its own, with a socket in a directory of its own.
struct Communicator {
    address: Address,
    directory: PathBuf,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Communicator {
    fn start() -> Result<Self, Failure> {
        let name = format!("jaus-tester-{}", std::process::id());
        let directory = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&directory).map_err(|error| Failure::file(&directory, &error))?;
        let address = place(&directory);
        let (stop, stopped) = oneshot::channel();
        let (ready, is_ready) = std::sync::mpsc::channel();
        let config = Config::loopback(101, 1)
            .local(address.clone())
            .without_udp();
        let thread = std::thread::spawn(move || {
            let served = runtime::run(async {
                let node = Node::start(config).map_err(Failure::of)?;
                let _ = ready.send(Ok(()));
                let _ = stopped.await;
                node.shutdown().await;
                Ok(())
            });
            if let Err(failure) = served {
                let _ = ready.send(Err(failure));
            }
        });
        let own = Self {
            address,
            directory,
            stop: Some(stop),
            thread: Some(thread),
        };
        match is_ready.recv() {
            Ok(started) => started.map(|()| own),
            Err(_) => Err(Failure::new("the node of the load did not start")),
        }
    }
}

#[cfg(unix)]
fn place(directory: &Path) -> Address {
    Address::Path(directory.join("node.sock"))
}

#[cfg(not(unix))]
fn place(_: &Path) -> Address {
    Address::Default
}

impl Drop for Communicator {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_dir_all(&self.directory);
    }
}
