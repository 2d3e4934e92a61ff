//! `jaus ping`: queries a component repeatedly and measures the round trip.
#![expect(
    clippy::disallowed_methods,
    reason = "measures round trips in real time"
)]

use std::fmt;
use std::future::Future;
use std::time::Duration;

use bytes::Bytes;
use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Outgoing, Path, Received};
use jaus::messages::core::{
    QueryHeartbeatPulse, QueryIdentification, ReportHeartbeatPulse, ReportIdentification,
    query_identification::QueryType,
};
use jaus::node::Port;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime::{self, size_within};
use serde_json::{Value as Json, json};
use tokio::time::{Instant, sleep_until, timeout_at};

/// The code of the padded message of `--size`: user-defined (AS5710 leaves D000h and above to
/// users), so that no service acts on it.
const PADDING: u16 = 0xD7F0;

/// Query a component and measure the round trip
///
/// Queries a heartbeat (Liveness service); if that is not answered, the identification (Discovery
/// service); and if that is not answered either, sends a message that requests acknowledgement
/// (transport). The first that is answered is repeated. Exit status 1 means that nothing was
/// answered.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus ping 101.1.33\n  \
    jaus ping 101.1.33 --count 10 --interval 100ms\n  \
    jaus ping 101.1.33 --json | jq .ms\n  \
    jaus ping 101.1.33 --with acknowledgement --size 64KiB\n  \
    jaus ping 101.1.33 --peer 192.168.7.2      for a host that multicast does not reach")]
pub(crate) struct Ping {
    /// The component to query: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID", value_parser = network::one_component)]
    address: JausId,

    /// The number of queries [default: until Ctrl-C]
    #[arg(long, short, value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,

    /// The interval between queries
    #[arg(long, short, default_value = "1s", value_parser = runtime::duration)]
    interval: Duration,

    /// How long to wait for each answer
    #[arg(long, short, default_value = "1s", value_parser = runtime::duration)]
    timeout: Duration,

    /// What to send [default: the first that the component answers]
    #[arg(long, value_enum)]
    with: Option<Question>,

    /// The size of the acknowledged message, such as 1500 or 64KiB, from 2 B to 16 MiB; implies
    /// --with acknowledgement
    #[arg(long, value_parser = |text: &str| size_within(text, 2, 16 << 20))]
    size: Option<usize>,

    /// Print JSON: one object for each query, and the summary
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    network: Network,
}

/// A message that shows whether a component is reachable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Question {
    /// Query Heartbeat Pulse, which Liveness answers
    Heartbeat,
    /// Query Identification, which Discovery answers
    Identification,
    /// A message that requests acknowledgement, which every transport answers
    Acknowledgement,
}

impl Question {
    const ALL: [Self; 3] = [Self::Heartbeat, Self::Identification, Self::Acknowledgement];
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Heartbeat => "heartbeat",
            Self::Identification => "identification",
            Self::Acknowledgement => "acknowledgement",
        })
    }
}

/// An answer with its round trip.
struct Answer {
    time: Duration,
    path: Option<Path>,
}

/// Queries and answers so far.
#[derive(Default)]
struct Tally {
    asked: u64,
    times: Vec<Duration>,
}

impl Ping {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if self.size.is_some()
            && self
                .with
                .is_some_and(|with| with != Question::Acknowledgement)
        {
            return Err(Failure::new(
                "--size applies to acknowledged messages only: omit --with, or use `--with \
                 acknowledgement`",
            ));
        }
        runtime::run(async {
            let (mut port, stay) = self.network.join_for_a_moment().await?;
            let outcome = self.go_on(&mut port).await;
            drop(port);
            stay.end().await;
            outcome
        })
    }

    /// Repeats the query until the count is reached or the user stops it, and prints a summary.
    async fn go_on(&self, port: &mut Port) -> Result<Outcome, Failure> {
        let mut output = Output::new();
        let mut tally = Tally::default();
        let end = runtime::end(None);
        tokio::pin!(end);
        tokio::select! {
            () = &mut end => {}
            result = self.ask_again_and_again(port, &mut tally, &mut output) => result?,
        }
        match self.json {
            true => output.line(tally.to_json())?,
            false => output.line(format_args!("\n{}: {tally}", self.address))?,
        }
        if tally.times.is_empty() && tally.asked > 0 {
            say(format_args!(
                "{} did not answer. {}",
                self.address,
                network::REMEDY
            ));
        }
        Ok(Outcome::complete_if(!tally.times.is_empty()))
    }

    async fn ask_again_and_again(
        &self,
        port: &mut Port,
        tally: &mut Tally,
        output: &mut Output,
    ) -> Result<(), Failure> {
        let chosen = self.size.map(|_| Question::Acknowledgement).or(self.with);
        let mut usual = chosen;
        while self.count.is_none_or(|count| tally.asked < count) {
            let next = Instant::now() + self.interval;
            tally.asked += 1;
            let questions = usual.map_or(Question::ALL.to_vec(), |usual| vec![usual]);
            let answer = self.ask_in_turn(port, &questions).await?;
            let number = tally.asked;
            if let Some((question, answer)) = &answer {
                usual = Some(*question);
                tally.times.push(answer.time);
            }
            match self.json {
                true => output.line(json_line(number, answer.as_ref()))?,
                false => output.line(words(number, answer.as_ref()))?,
            }
            if self.count.is_none_or(|count| tally.asked < count) {
                sleep_until(next).await;
            }
        }
        Ok(())
    }

    /// Finds the first query that is answered.
    async fn ask_in_turn(
        &self,
        port: &mut Port,
        questions: &[Question],
    ) -> Result<Option<(Question, Answer)>, Failure> {
        for &question in questions {
            let answer = match question {
                Question::Heartbeat => {
                    let query = QueryHeartbeatPulse.encode().map_err(Failure::of)?;
                    self.ask(port, query, ReportHeartbeatPulse::CODE).await?
                }
                Question::Identification => {
                    let query = QueryIdentification {
                        query_type: QueryType::COMPONENT_IDENTIFICATION,
                    };
                    let query = query.encode().map_err(Failure::of)?;
                    self.ask(port, query, ReportIdentification::CODE).await?
                }
                Question::Acknowledgement => self.have_acknowledged(port).await?,
            };
            if let Some(answer) = answer {
                return Ok(Some((question, answer)));
            }
        }
        Ok(None)
    }

    async fn ask(
        &self,
        port: &mut Port,
        query: Bytes,
        report: u16,
    ) -> Result<Option<Answer>, Failure> {
        // Discard late answers to an earlier query.
        while port.try_recv().is_some() {}
        let start = Instant::now();
        let outgoing = Outgoing::new(port.id(), self.address, query);
        port.send(outgoing).map_err(Failure::of)?;
        while let Some(received) = self.in_time(start, port.recv()).await.flatten() {
            if self.is_answer(&received, report) {
                return Ok(Some(Answer {
                    time: start.elapsed(),
                    path: received.path,
                }));
            }
        }
        Ok(None)
    }

    async fn have_acknowledged(&self, port: &Port) -> Result<Option<Answer>, Failure> {
        let mut message = vec![0; self.size.unwrap_or(2)];
        message[..2].copy_from_slice(&PADDING.to_le_bytes());
        let start = Instant::now();
        let outgoing = Outgoing::new(port.id(), self.address, message.into());
        match self.in_time(start, port.deliver(outgoing)).await {
            Some(Ok(())) => Ok(Some(Answer {
                time: start.elapsed(),
                path: None,
            })),
            Some(Err(jaus::node::Undelivered::NotSent(error))) => Err(Failure::of(error)),
            Some(Err(_)) | None => Ok(None),
        }
    }

    async fn in_time<T>(&self, start: Instant, what: impl Future<Output = T>) -> Option<T> {
        timeout_at(start + self.timeout, what).await.ok()
    }

    fn is_answer(&self, received: &Received, report: u16) -> bool {
        received.source == self.address && received.payload.starts_with(&report.to_le_bytes())
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (asked, answered) = (self.asked, self.times.len());
        let lost = 100.0 * (asked as f64 - answered as f64) / (asked.max(1) as f64);
        write!(f, "{asked} queries, {answered} answers, {lost:.0} % lost")?;
        let mut times = self.times.clone();
        times.sort_unstable();
        let (Some(&least), Some(&most)) = (times.first(), times.last()) else {
            return Ok(());
        };
        let (least, median, most) = (millis(least), millis(times[times.len() / 2]), millis(most));
        write!(f, "; min {least}, median {median}, max {most} ms")
    }
}

impl Tally {
    fn to_json(&self) -> Json {
        let mut times = self.times.clone();
        times.sort_unstable();
        let at = |place: usize| times.get(place).map(|&time| number(time));
        json!({
            "queries": self.asked,
            "answers": times.len(),
            "min_ms": at(0),
            "median_ms": at(times.len() / 2),
            "max_ms": at(times.len().saturating_sub(1)),
        })
    }
}

/// A line for one query, for people.
fn words(number: u64, answer: Option<&(Question, Answer)>) -> String {
    let Some((question, answer)) = answer else {
        return format!("{number:>4}  no answer");
    };
    let from = answer.path.map(|path| format!(" from {}", path.peer));
    let (from, time) = (from.unwrap_or_default(), millis(answer.time));
    format!("{number:>4}  {question}{from}: {time} ms")
}

/// The same as an object.
fn json_line(number: u64, answer: Option<&(Question, Answer)>) -> Json {
    let (question, answer) = answer.map(|(question, answer)| (question, answer)).unzip();
    json!({
        "query": number,
        "with": question.map(Question::to_string),
        "from": answer.and_then(|it| it.path).map(|path| path.peer.to_string()),
        "ms": answer.map(|it| self::number(it.time)),
    })
}

/// Milliseconds, to the microsecond.
fn number(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

/// Milliseconds, to the microsecond, as text.
fn millis(time: Duration) -> String {
    format!("{:.3}", time.as_secs_f64() * 1e3)
}
