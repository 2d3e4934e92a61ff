//! Runs steps: sends messages, waits for the required answers, and decides.
#![expect(clippy::disallowed_methods, reason = "the judge runs in real time")]

use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message;
use jaus::messages::core::{
    CancelEvent, ClearEmergency, Event, ReleaseControl, clear_emergency::EmergencyCode,
};
use jaus_cli::failure::Failure;
use tokio::time::{Instant, sleep_until};

use super::judge_nodes::{Heard, JudgeNodes};
use super::memory::Memory;
use super::step::{
    Act, Check, Exchange, Expectation, Form, Name, Reach, Speaker, Step, Throughout, Until,
};
use super::subject::Subject;
use super::verdict::{ObservedMessage, Proceeding, StepResult, Verdict};
use super::watch::Observation;

/// Runs one step after the other.
pub(super) struct Runner {
    judge_nodes: JudgeNodes,
    memory: Memory,
    /// Timeout of an answer.
    limit: Duration,
    /// The current step, for the recording.
    step: String,
    /// The step at which the subject ceased to answer.
    silent_since: Option<Name>,
}

/// Result of an act: the check, or a failure of the judge itself.
type Came = Result<Check, Failure>;

impl Runner {
    pub(super) fn new(judge_nodes: JudgeNodes, subject: &Subject, limit: Duration) -> Self {
        let memory = Memory::new(subject.id, judge_nodes.ids());
        Self {
            judge_nodes,
            memory,
            limit,
            step: String::new(),
            silent_since: None,
        }
    }

    /// Starts a form: resets the state and uses the form for all further messages.
    pub(super) fn begin(&mut self, form: Form) {
        self.judge_nodes.use_form(form);
        self.silent_since = None;
        self.memory = Memory::new(self.memory.subject, self.judge_nodes.ids());
    }

    /// Runs a step.
    pub(super) async fn carry_out(
        &mut self,
        step: &Step,
        form: Form,
        subject: &Subject,
    ) -> Result<StepResult, Failure> {
        self.step = format!("{} {}: {}", step.name, form.name(), step.title);
        let start = Instant::now();
        let mut proceedings = Vec::new();
        let verdict = if let Some(urn) = subject.lacks(&step.needs) {
            let service = urn.rsplit(':').next().unwrap_or(urn);
            Verdict::Skipped(format!("{service} is not offered"))
        } else if let Some(since) = self.silent_since {
            Verdict::Skipped(format!("silent since {since}"))
        } else {
            match self.act(step, &mut proceedings).await? {
                Ok(()) => Verdict::Passed,
                Err(reason) => self.failed(step, reason, &proceedings).await?,
            }
        };
        Ok(StepResult {
            name: step.name,
            title: step.title.to_string(),
            form,
            verdict,
            took: start.elapsed(),
            proceedings,
        })
    }

    /// The verdict of a step that failed. If nothing was heard in it, the subject may have ended or
    /// hang; then the steps to come would fail for that reason alone.
    async fn failed(
        &mut self,
        step: &Step,
        reason: String,
        proceedings: &[Proceeding],
    ) -> Result<Verdict, Failure> {
        let was_silent = proceedings.iter().all(|it| it.received.is_empty());
        if !was_silent || Subject::answers(&mut self.judge_nodes, self.limit).await? {
            return Ok(Verdict::Failed(reason));
        }
        self.silent_since = Some(step.name);
        Ok(Verdict::Failed(format!(
            "{reason}; it answers no query any more: it hangs, or has ended"
        )))
    }

    async fn act(&mut self, step: &Step, proceedings: &mut Vec<Proceeding>) -> Came {
        let mut check = Ok(());
        for act in &step.acts {
            check = match act {
                Act::Exchange(exchange) => self.exchange(exchange, proceedings).await?,
                Act::Asked { code, name, within } => {
                    self.be_asked(*code, name, *within, proceedings).await?
                }
                Act::Watch(watch) => {
                    let streams = (watch.streams)(&self.memory);
                    self.watch(
                        streams.map(|streams| Observation::watch(watch, streams)),
                        proceedings,
                    )
                    .await?
                }
                Act::Silence { streams, lasting } => {
                    let streams = streams(&self.memory);
                    let silence = |streams| Observation::silence(streams, *lasting);
                    self.watch(streams.map(silence), proceedings).await?
                }
                Act::Ignored { exchange, lasting } => {
                    self.be_ignored(exchange, *lasting, proceedings).await?
                }
                Act::Pause(time) => {
                    self.listen_until(Instant::now() + *time).await?;
                    Ok(())
                }
                Act::Until(until) => self.until(until, proceedings).await?,
                Act::Throughout(throughout) => self.throughout(throughout, proceedings).await?,
            };
            if check.is_err() {
                break;
            }
        }
        for exchange in &step.afterwards {
            // The result does not matter; the step is already decided.
            let _ = self.exchange(exchange, &mut Vec::new()).await?;
        }
        Ok(check)
    }

    /// Sends a message, and waits for all required answers.
    async fn exchange(&mut self, exchange: &Exchange, proceedings: &mut Vec<Proceeding>) -> Came {
        self.judge_nodes.clear(&self.step).await?;
        let octets = match (exchange.content)(&self.memory) {
            Ok(octets) => octets,
            Err(reason) => return Ok(Err(reason)),
        };
        let start = Instant::now();
        let said = self
            .judge_nodes
            .say(exchange.from, exchange.reach, octets, &self.step)?;
        let expected = exchange.expects.iter().map(|one| self.in_words(one));
        let mut proceeding = Proceeding::of(Some(said), expected.collect());
        let is_optional = exchange.expects.iter().all(|one| one.is_optional);
        let patience = if is_optional {
            OPTIONAL.min(self.limit)
        } else {
            self.limit
        };
        let deadline = start + patience;
        let mut missing: Vec<&Expectation> = exchange.expects.iter().collect();
        let mut check = Ok(());
        // Why the latest part of an answer is wrong.
        let mut wrong = None;
        while check.is_ok() && !missing.is_empty() {
            let Some(heard) = self.judge_nodes.hear(deadline, &self.step).await? else {
                check = match wrong {
                    Some(reason) => Err(reason),
                    None if is_optional => Ok(()),
                    None => Err(self.silence(missing[0], &proceeding)),
                };
                break;
            };
            let is_it = |one: &&Expectation| heard.code() == Some(one.code) && heard.to == one.to;
            let found = missing.iter().position(is_it);
            // Events arrive independently of the exchange.
            if found.is_some() || heard.code() != Some(Event::CODE) {
                proceeding.received.push(self.said(&heard));
            }
            if let Some(found) = found {
                let expectation = missing[found];
                proceeding.latency = Some(heard.at - start);
                match expectation.look_at(&heard.octets, &mut self.memory) {
                    Ok(()) => drop(missing.remove(found)),
                    Err(reason) if expectation.in_parts => wrong = Some(reason),
                    Err(reason) => check = Err(reason),
                }
            }
        }
        proceedings.push(proceeding);
        Ok(check)
    }

    /// Sends a message, and requires that it has no effect.
    async fn be_ignored(
        &mut self,
        exchange: &Exchange,
        lasting: Duration,
        proceedings: &mut Vec<Proceeding>,
    ) -> Came {
        let check = self.exchange(exchange, proceedings).await?;
        if check.is_err() {
            return Ok(check);
        }
        let deadline = Instant::now() + lasting;
        let words = format!("nothing for {} s", lasting.as_secs_f64());
        let mut proceeding = Proceeding::of(None, vec![words]);
        let mut check = Ok(());
        while let Some(heard) = self.judge_nodes.hear(deadline, &self.step).await? {
            if heard.code() != Some(Event::CODE) && heard.to == exchange.from {
                check = Err(format!("it was answered with {}", name_of(&heard.octets)));
                proceeding.received.push(self.said(&heard));
                break;
            }
        }
        proceedings.push(proceeding);
        Ok(check)
    }

    /// Waits for a query of the subject to the judge.
    async fn be_asked(
        &mut self,
        code: u16,
        name: &str,
        within: Duration,
        proceedings: &mut Vec<Proceeding>,
    ) -> Came {
        let deadline = Instant::now() + within;
        while !self.judge_nodes.was_asked(code) && Instant::now() < deadline {
            let soon = Instant::now() + Duration::from_millis(50);
            self.listen_until(soon.min(deadline)).await?;
        }
        let expected = format!("{name} ({code:04X}h) from the subject itself");
        proceedings.push(Proceeding::of(None, vec![expected]));
        if self.judge_nodes.was_asked(code) {
            return Ok(Ok(()));
        }
        Ok(Err(format!(
            "the subject has not sent {name} by itself within {} s",
            within.as_secs_f64()
        )))
    }

    /// Observes event streams.
    async fn watch(
        &mut self,
        observation: Result<Observation, String>,
        proceedings: &mut Vec<Proceeding>,
    ) -> Came {
        let mut observation = match observation {
            Ok(observation) => observation,
            Err(reason) => return Ok(Err(reason)),
        };
        let deadline = Instant::now() + observation.at_most(self.limit);
        while !observation.is_complete() {
            let Some(heard) = self.judge_nodes.hear(deadline, &self.step).await? else {
                break;
            };
            if heard.to == Speaker::Main {
                observation.note(heard.at, &heard.octets);
            }
        }
        let mut proceeding = Proceeding::of(None, vec![observation.in_words()]);
        proceeding.measured = Some(observation.measured());
        proceedings.push(proceeding);
        Ok(observation.check())
    }

    /// Repeats exchanges until a condition is reached.
    async fn until(&mut self, until: &Until, proceedings: &mut Vec<Proceeding>) -> Came {
        let start = Instant::now();
        let mut next = start;
        let check = loop {
            let mut round = Vec::new();
            for exchange in &until.exchanges {
                let check = self.exchange(exchange, &mut round).await?;
                if check.is_err() {
                    proceedings.append(&mut round);
                    return Ok(check);
                }
            }
            let check = (until.reached)(&self.memory);
            if check.is_ok() || start.elapsed() >= until.at_most {
                break check;
            }
            next += until.every;
            self.listen_until(next).await?;
        };
        let mut proceeding = Proceeding::of(None, vec![until.words.to_owned()]);
        proceeding.measured = Some(format!("after {:.1} s", start.elapsed().as_secs_f64()));
        proceedings.push(proceeding);
        Ok(check.map_err(|reason| format!("{reason}, within {} s", until.at_most.as_secs_f64())))
    }

    /// Repeats exchanges for a time, during which a condition must hold.
    async fn throughout(
        &mut self,
        throughout: &Throughout,
        proceedings: &mut Vec<Proceeding>,
    ) -> Came {
        let start = Instant::now();
        let mut next = start;
        let check = loop {
            let mut round = Vec::new();
            for exchange in &throughout.exchanges {
                let check = self.exchange(exchange, &mut round).await?;
                if check.is_err() {
                    proceedings.append(&mut round);
                    return Ok(check);
                }
            }
            let check = (throughout.holds)(&self.memory);
            if check.is_err() || start.elapsed() >= throughout.lasting {
                break check;
            }
            next += throughout.every;
            self.listen_until(next).await?;
        };
        let lasted = start.elapsed().as_secs_f64();
        let mut proceeding = Proceeding::of(None, vec![throughout.words.to_owned()]);
        proceeding.measured = Some(format!("for {lasted:.1} s"));
        proceedings.push(proceeding);
        Ok(check.map_err(|reason| format!("{reason} after {lasted:.1} s of commands")))
    }

    /// Restores the subject's initial state: no events, no emergency, no controller.
    pub(super) async fn tidy(&mut self) -> Result<(), Failure> {
        self.step = "tidying up".to_owned();
        let streams = std::mem::take(&mut self.memory.streams);
        let cancellations = (1_u8..)
            .zip(streams)
            .map(|(request_id, stream)| CancelEvent {
                request_id,
                event_id: stream.id,
            });
        for cancellation in cancellations {
            self.tell(Speaker::Main, &cancellation)?;
        }
        let clear = ClearEmergency {
            emergency_code: EmergencyCode(1),
        };
        self.tell(Speaker::Fourth, &clear)?;
        for speaker in Speaker::ALL {
            self.tell(speaker, &ReleaseControl)?;
        }
        self.listen_until(Instant::now() + TIDYING).await
    }

    fn tell(&mut self, from: Speaker, message: &impl Message) -> Result<(), Failure> {
        let octets = message.encode().map_err(Failure::of)?;
        let said = self
            .judge_nodes
            .say(from, Reach::Component, octets, &self.step);
        said.map(drop)
    }

    /// Waits, and answers the subject's queries meanwhile.
    async fn listen_until(&mut self, deadline: Instant) -> Result<(), Failure> {
        // The messages do not matter; the next exchange clears the queue anyway.
        while let Some(heard) = self.judge_nodes.hear(deadline, &self.step).await? {
            drop(heard);
        }
        sleep_until(deadline).await;
        Ok(())
    }

    /// Stops the judge's nodes.
    pub(super) async fn end(self) -> Result<(), Failure> {
        self.judge_nodes.end().await
    }

    fn said(&self, heard: &Heard) -> ObservedMessage {
        ObservedMessage {
            from: self.memory.subject,
            to: self.memory.id(heard.to),
            octets: heard.octets.clone(),
        }
    }

    fn in_words(&self, expectation: &Expectation) -> String {
        let Expectation {
            name, code, words, ..
        } = expectation;
        let to = self.memory.id(expectation.to);
        let colon = if words.is_empty() { "" } else { ": " };
        format!("{name} ({code:04X}h) to {to}{colon}{words}")
    }

    /// Explains why no received message is acceptable.
    fn silence(&self, missing: &Expectation, proceeding: &Proceeding) -> String {
        let (name, to) = (&missing.name, self.memory.id(missing.to));
        let limit = self.limit.as_secs_f64();
        let instead = proceeding.received.iter();
        let instead = instead.map(|said| format!("{} to {}", name_of(&said.octets), said.to));
        let instead: Vec<_> = instead.collect();
        if instead.is_empty() {
            return format!("no {name} reached {to} within {limit} s");
        }
        format!(
            "no {name} reached {to} within {limit} s, but {}",
            instead.join(", ")
        )
    }
}

/// Timeout of an optional answer.
const OPTIONAL: Duration = Duration::from_millis(300);
/// Time for the last commands to arrive.
const TIDYING: Duration = Duration::from_millis(100);

/// The name of a message, or its code.
fn name_of(octets: &Bytes) -> String {
    let Some(code) = super::step::code_of(octets) else {
        return "a message without a code".to_owned();
    };
    let known = jaus_vehicle::messages::registry().by_code(code).next();
    known.map_or_else(|| format!("{code:04X}h"), |info| info.name.to_owned())
}

impl Proceeding {
    fn of(sent: Option<ObservedMessage>, expected: Vec<String>) -> Self {
        Self {
            sent,
            expected,
            received: Vec::new(),
            measured: None,
            latency: None,
        }
    }
}
