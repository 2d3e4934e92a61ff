//! A scripted client: it discovers, queries, subscribes, controls and drives, in the steps seen in
//! captures.

use std::time::{Duration, Instant};

use jaus::address::JausId;

use super::body;
use super::speaker::Speaker;
use super::vehicle::SERVICES;

/// Time without an answer after which a query is repeated.
const AGAIN: Duration = Duration::from_millis(500);
/// Interval of the commands.
const BEAT: Duration = Duration::from_millis(100);
/// Intervals of checking its events and renewing control.
const UPKEEP: Duration = Duration::from_secs(5);
const RENEWAL: Duration = Duration::from_millis(1250);
/// Consecutive reports that prove a subscription, and changes that prove one on change.
const ENOUGH: usize = 10;
const CHANGES: usize = 3;
/// Report rate.
const HZ: f64 = 10.0;
/// Least speed that counts as motion, in m/s, and the effort for it in percent.
const MOTION: f64 = 0.1;
const PUSH: f64 = 60.0;
/// The judging tool's authority code, and the next higher one.
const AUTHORITIES: [u8; 2] = [127, 128];
/// The status of a component that accepts commands.
const READY: u8 = 1;
/// Query Velocity State for the forward velocity.
const FORWARD: [u8; 4] = [0x04, 0x24, 1, 0];

/// A client of one other component.
pub(super) struct Asker {
    pub(super) speaker: Speaker,
    pub(super) other: JausId,
    pub(super) deadline: Instant,
}

impl Asker {
    /// Repeats a message until `take` accepts an answer, and returns its value.
    fn ask<T>(&mut self, message: &[u8], take: impl Fn(&[u8]) -> Option<T>) -> Result<T, String> {
        self.ask_from(self.other, message, take)
    }

    /// The same for a message to another component or a broadcast; only the other party's answers
    /// count.
    fn ask_from<T>(
        &mut self,
        whom: JausId,
        message: &[u8],
        take: impl Fn(&[u8]) -> Option<T>,
    ) -> Result<T, String> {
        while Instant::now() < self.deadline {
            self.speaker.say(whom, message);
            if let Some(answer) = self.wait(AGAIN, &take) {
                return Ok(answer);
            }
        }
        let code = body::code(message).unwrap_or_default();
        Err(format!("{code:04X}h was not answered"))
    }

    /// Waits for a message of the other party that `take` accepts; answers its identification
    /// queries meanwhile.
    fn wait<T>(&mut self, time: Duration, take: impl Fn(&[u8]) -> Option<T>) -> Option<T> {
        let deadline = Instant::now() + time;
        loop {
            let heard = self.speaker.hear(deadline)?;
            if heard.source == self.other
                && let Some(taken) = take(&heard.payload)
            {
                return Some(taken);
            }
            if body::code(&heard.payload) == Some(body::QUERY_IDENTIFICATION) {
                self.introduce(heard.source);
            }
        }
    }

    fn introduce(&mut self, to: JausId) {
        // An operator control unit, as a subsystem.
        let name = self.speaker.habits.name.as_bytes();
        let head = [2, 0x21, 0x4E, name.len() as u8];
        let report = body::message(body::report(body::QUERY_IDENTIFICATION), &[&head, name]);
        self.speaker.say(to, &report);
    }

    /// Broadcasts Query Identification, then queries the other party's configuration and services.
    pub(super) fn discover(&mut self) -> Result<(), String> {
        let who = body::message(body::QUERY_IDENTIFICATION, &[&[2]]);
        self.ask_from(
            JausId::EVERYONE,
            &who,
            answer_to(body::QUERY_IDENTIFICATION),
        )?;
        println!("{} has answered", self.other);
        if self.speaker.habits.registers {
            let register =
                body::message(body::REGISTER_SERVICES, &[&body::services(&SERVICES[..7])]);
            self.speaker.say(self.other, &register);
        }
        let configuration = body::message(body::QUERY_CONFIGURATION, &[&[2]]);
        self.ask(&configuration, answer_to(body::QUERY_CONFIGURATION))?;
        let list = [1, self.other.node(), 1, self.other.component()];
        let services = body::message(body::QUERY_SERVICES, &[&list]);
        let report = self.ask(&services, answer_to(body::QUERY_SERVICES))?;
        // The answer contains the service names as plain text.
        println!("{}", String::from_utf8_lossy(&report));
        Ok(())
    }

    /// Queries the velocity.
    pub(super) fn query(&mut self) -> Result<f64, String> {
        let report = self.ask(&FORWARD, answer_to(body::QUERY_VELOCITY))?;
        body::velocity_in(&report).ok_or("a report without the velocity".to_owned())
    }

    /// Creates an event for the velocity. Returns its id.
    fn subscribe(&mut self, hz: Option<f64>) -> Result<u8, String> {
        let create = body::create_event(1, hz, &FORWARD);
        self.ask(&create, |answer| match answer {
            [0xF3, 0x01, 1, id, ..] => Some(*id),
            _ => None,
        })
    }

    fn cancel(&mut self, id: u8) -> Result<(), String> {
        let cancel = body::message(body::CANCEL_EVENT, &[&[2, id]]);
        self.ask(&cancel, |answer| {
            answer.starts_with(&[0xF3, 0x01, 2]).then_some(())
        })
    }

    /// Waits for the next event.
    fn event(&mut self, time: Duration) -> Option<f64> {
        self.wait(time, |message| {
            let is_event = body::code(message) == Some(body::EVENT);
            is_event
                .then(|| body::velocity_in(body::report_in(message)?))
                .flatten()
        })
    }

    /// Subscribes to the velocity at a rate, and expects [`ENOUGH`] reports.
    pub(super) fn periodic(&mut self) -> Result<(), String> {
        let id = self.subscribe(Some(HZ))?;
        for number in 0..ENOUGH {
            let left = self.deadline.saturating_duration_since(Instant::now());
            self.event(left)
                .ok_or_else(|| format!("{number} reports, and then none"))?;
        }
        self.cancel(id)
    }

    /// Prints each velocity report, until killed.
    pub(super) fn keep(&mut self) -> Result<(), String> {
        loop {
            self.deadline = Instant::now() + UPKEEP;
            if self.subscribe(Some(HZ)).is_err() {
                println!("not yet");
                continue;
            }
            let mut looked = Instant::now();
            while let Some(velocity) = self.event(2 * AGAIN) {
                println!("report: {velocity:.3} m/s");
                if self.speaker.habits.looks_after_events && looked.elapsed() > UPKEEP {
                    looked = Instant::now();
                    self.look_after_events();
                }
            }
            println!("nothing comes any more");
        }
    }

    /// Queries the event by its id; creates it again if it is not listed.
    fn look_after_events(&mut self) {
        let query = body::message(body::QUERY_EVENTS, &[&[2, 0]]);
        self.speaker.say(self.other, &query);
        let listed = self.wait(AGAIN, answer_to(body::QUERY_EVENTS));
        let is_there = |list: Vec<u8>| list.windows(2).any(|code| code == &FORWARD[..2]);
        if !listed.is_some_and(is_there) {
            println!("the event is not listed, and is created again");
            self.speaker
                .say(self.other, &body::create_event(0, Some(1.0), &FORWARD));
        }
    }

    fn request(&mut self, authority: u8) -> Result<(), String> {
        let request = body::message(body::REQUEST_CONTROL, &[&[authority]]);
        match self.ask(&request, answer_to_request)? {
            0 => Ok(()),
            code => Err(format!("control was not granted: response code {code}")),
        }
    }

    fn release(&mut self) -> Result<(), String> {
        let release = body::message(body::RELEASE_CONTROL, &[]);
        let is_rejected =
            |answer: &[u8]| (body::code(answer)? == body::REJECT_CONTROL).then_some(());
        self.ask(&release, is_rejected)
    }

    /// Takes control, loses it to a second client with more authority, which releases it.
    pub(super) fn control(&mut self, colleague: &mut Self) -> Result<(), String> {
        self.request(AUTHORITIES[0])?;
        colleague.request(AUTHORITIES[1])?;
        let left = self.deadline.saturating_duration_since(Instant::now());
        let rejected =
            |message: &[u8]| (body::code(message)? == body::REJECT_CONTROL).then_some(());
        self.wait(left, rejected)
            .ok_or("it was not told that it has lost control")?;
        colleague.release()?;
        let query = body::message(body::QUERY_CONTROL, &[]);
        let report = self.ask(&query, answer_to(body::QUERY_CONTROL))?;
        let nobody = report.get(2..6) == Some(&[0; 4][..]);
        nobody.then_some(()).ok_or(format!(
            "it was released, and is still controlled: {report:?}"
        ))
    }

    /// Takes control, moves the vehicle, and stops it.
    pub(super) fn drive(&mut self) -> Result<(), String> {
        self.make_ready()?;
        self.push_until(|asker| Ok(asker.query()? > MOTION))?;
        self.stop()
    }

    /// Subscribes to the velocity on change, changes it, and expects the reports.
    pub(super) fn on_change(&mut self) -> Result<(), String> {
        let id = self.subscribe(None)?;
        self.make_ready()?;
        let mut velocities = Vec::new();
        self.push_until(|asker| {
            velocities.extend(asker.event(BEAT));
            velocities.dedup();
            Ok(velocities.len() >= CHANGES)
        })?;
        self.stop()?;
        self.cancel(id)
    }

    fn make_ready(&mut self) -> Result<(), String> {
        self.request(AUTHORITIES[0])?;
        let (resume, status) = (
            body::message(body::RESUME, &[]),
            body::message(body::QUERY_STATUS, &[]),
        );
        while Instant::now() < self.deadline {
            self.speaker.say(self.other, &resume);
            let report = self.ask(&status, answer_to(body::QUERY_STATUS))?;
            if report.get(2) == Some(&READY) {
                return Ok(());
            }
        }
        Err("it was told to resume, and is not ready".to_owned())
    }

    /// Sends forward effort until the condition holds; renews control meanwhile.
    fn push_until(
        &mut self,
        mut is_so: impl FnMut(&mut Self) -> Result<bool, String>,
    ) -> Result<(), String> {
        let mut renewed = Instant::now();
        while Instant::now() < self.deadline {
            self.speaker.say(self.other, &body::push(PUSH));
            if is_so(self)? {
                return Ok(());
            }
            if renewed.elapsed() > RENEWAL {
                renewed = Instant::now();
                self.request(AUTHORITIES[0])?;
            }
            std::thread::sleep(BEAT);
        }
        Err("it was pushed, and nothing came of it".to_owned())
    }

    fn stop(&mut self) -> Result<(), String> {
        self.speaker.say(self.other, &body::push(0.0));
        self.speaker
            .say(self.other, &body::message(body::STANDBY, &[]));
        self.release()
    }
}

/// Accepts the report that answers a query.
fn answer_to(query: u16) -> impl Fn(&[u8]) -> Option<Vec<u8>> {
    move |answer| (body::code(answer)? == body::report(query)).then(|| answer.to_vec())
}

/// Accepts Confirm Control and returns its response code.
fn answer_to_request(answer: &[u8]) -> Option<u8> {
    (body::code(answer)? == body::CONFIRM_CONTROL)
        .then(|| answer.get(2).copied())
        .flatten()
}
