//! Encounter of two parties: one acts on the other in every scenario, on their own network.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::suite::hosts::{Host, Hosts};
use crate::suite::party::{Place, Values, patience};
use crate::suite::process::Process;
use crate::suite::scenario::{KEEP, LOAD, Scenario};
use crate::suite::settings::{Party, Side};
use crate::suite::verdict::{Cell, Column, Verdict};

/// Text that a continuous query prints for each answer.
const ANSWERED: &str = "report";
/// Consecutive answers that prove that answers continue.
const ENOUGH: usize = 3;
/// Pause between two attempts of a scenario that may be retried.
const PAUSE: Duration = Duration::from_millis(300);
/// Size limit of a recording, so that long runs do not fill the disk.
const LARGEST_RECORDING: &str = "100MB";

/// Two parties on their hosts.
struct Encounter<'a> {
    actor: Place<'a>,
    answerer: Place<'a>,
    hosts: &'a Hosts,
    directory: &'a Path,
    /// Scenarios that have failed so far.
    failed: Vec<Scenario>,
}

/// Runs these scenarios. The files of the run stay in `directory`.
///
/// # Errors
/// If the network or the files cannot be created.
pub(crate) fn run(
    (peer, actor, answerer): (&str, &Party, &Party),
    scenarios: &[Scenario],
    directory: &Path,
) -> Result<Column, String> {
    // Remove the leftovers of the previous run.
    let _ = std::fs::remove_dir_all(directory);
    std::fs::create_dir_all(directory)
        .map_err(|error| format!("{}: {error}", directory.display()))?;
    let hosts = Hosts::new()?;
    let mut encounter = Encounter {
        actor: Place::new(actor, answerer, Host::Actor, &hosts, directory),
        answerer: Place::new(answerer, actor, Host::Answerer, &hosts, directory),
        hosts: &hosts,
        directory,
        failed: Vec::new(),
    };
    let cells = scenarios.iter().map(|&scenario| encounter.cell(scenario));
    Ok(Column {
        peer: peer.to_owned(),
        actor: actor.name.clone(),
        answerer: answerer.name.clone(),
        cells: cells.collect(),
    })
}

impl Encounter<'_> {
    /// Runs a scenario: one cell of the table.
    fn cell(&mut self, scenario: Scenario) -> Cell {
        let start = Instant::now();
        let mut recording = None;
        let verdict = match self.way(scenario) {
            Err(reason) => Verdict::NotApplicable(reason),
            Ok((side, act)) => {
                let file = self.directory.join(format!("{}.pcapng", scenario.key()));
                let observer = self.observe(&file);
                let tried = self.carry_out(scenario, side, act);
                drop(observer);
                match tried {
                    Ok(()) => {
                        // Only failures are examined.
                        let _ = std::fs::remove_file(&file);
                        Verdict::Passed
                    }
                    Err(reason) => {
                        self.failed.push(scenario);
                        recording = file.exists().then_some(file);
                        Verdict::Failed(self.answerer.trouble().unwrap_or(reason))
                    }
                }
            }
        };
        Cell {
            scenario,
            verdict,
            took: start.elapsed(),
            recording,
        }
    }

    /// The answerer's side and the actor's act, or why the scenario does not apply.
    fn way(&self, scenario: Scenario) -> Result<(Side, &'static str), String> {
        let (actor, answerer) = (self.actor.party, self.answerer.party);
        let excuse = actor.excuse_of_actor(scenario);
        if let Some(reason) = excuse.or(answerer.excuse_of_answerer(scenario)) {
            return Err(reason.to_owned());
        }
        let ways = match (scenario.side(), scenario.act()) {
            (Some(side), Some(act)) => vec![(side, act)],
            _ => KEEP.to_vec(),
        };
        let can_ask = |(_, act): &(Side, &str)| actor.act.contains_key(*act);
        let can_answer = |(side, _): &(Side, &str)| answerer.side.contains_key(side);
        if let Some(way) = ways.iter().find(|way| can_ask(way) && can_answer(way)) {
            return Ok(*way);
        }
        Err(match ways.iter().find(|way| can_ask(way)) {
            Some((side, _)) => format!("{} does not play {side}", answerer.name),
            None => format!("{} has no command for it", actor.name),
        })
    }

    fn observe(&self, file: &Path) -> Option<Process> {
        let command = [
            env!("CARGO_BIN_EXE_jaus"),
            "record",
            &file.display().to_string(),
            "--overwrite",
            "--quiet",
            "--interface",
            Hosts::observed(),
            "--size",
            LARGEST_RECORDING,
        ];
        let log: PathBuf = self.directory.join("observer.log");
        // The recording is optional.
        Process::start(&self.hosts.switch(), &command.map(str::to_owned), &log).ok()
    }

    fn carry_out(&mut self, scenario: Scenario, side: Side, act: &str) -> Result<(), String> {
        self.actor.be(None)?;
        self.answerer.be(Some(side))?;
        match scenario {
            Scenario::AnswererRestarts => self.restart_answerer(act),
            Scenario::ActorRestarts => self.restart_actor(act),
            Scenario::Cable => self.pull_cable(act),
            Scenario::Mixed => self.mix(side, act),
            _ => self.try_until_right(scenario, act),
        }
    }

    /// Runs the act, repeatedly if the scenario permits it, until it succeeds.
    fn try_until_right(&self, scenario: Scenario, act: &str) -> Result<(), String> {
        let deadline = Instant::now() + patience();
        loop {
            let result = self.try_once(scenario, act);
            if result.is_ok() || !scenario.may_try_again() || Instant::now() > deadline {
                return result;
            }
            std::thread::sleep(PAUSE);
        }
    }

    fn try_once(&self, scenario: Scenario, act: &str) -> Result<(), String> {
        let values = Values {
            octets: scenario.octets(),
            ..Values::default()
        };
        let process = self.actor.act(act, &values, &scenario.key())?;
        // The actor needs a moment to print what it did not receive.
        let said = process.ends(patience() + Duration::from_secs(10))?;
        self.check(scenario, &said)
    }

    /// Checks that the actor's output names the expected ids or services.
    fn check(&self, scenario: Scenario, said: &str) -> Result<(), String> {
        let (actor, answerer) = (self.actor.party, self.answerer.party);
        if let Some(words) = actor.finds.get(&scenario.key()) {
            return find_all(words, said);
        }
        match scenario {
            Scenario::Discover => {
                let id = answerer.id.to_string();
                let between = |character: char| !character.is_ascii_digit() && character != '.';
                let is_found = said.split(between).any(|word| word == id);
                is_found.then_some(()).ok_or(format!("{id} was not found"))
            }
            Scenario::Services => match answerer.side.get(&Side::Vehicle) {
                Some(side) => find_all(&side.services, said),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// Starts continuous queries and waits for the first answers.
    fn keep(&self, act: &str) -> Result<Process, String> {
        let mut keep = self.actor.act(act, &Values::default(), "keep")?;
        goes_on(&mut keep)?;
        Ok(keep)
    }

    fn restart_answerer(&mut self, act: &str) -> Result<(), String> {
        let mut keep = self.keep(act)?;
        let side = self.answerer.crash();
        self.answerer.be(side)?;
        keep.forget();
        goes_on(&mut keep)
    }

    fn restart_actor(&mut self, act: &str) -> Result<(), String> {
        let keep = self.keep(act)?;
        self.actor.crash();
        drop(keep);
        self.actor.be(None)?;
        self.keep(act).map(drop)
    }

    fn pull_cable(&self, act: &str) -> Result<(), String> {
        let mut keep = self.keep(act)?;
        self.hosts.cable(false)?;
        std::thread::sleep(Duration::from_secs(crate::suite::number(
            "JAUS_INTEROP_CABLE",
            10,
        )));
        self.hosts.cable(true)?;
        keep.forget();
        goes_on(&mut keep)
    }

    /// Runs continuous queries and, in turn, every scenario that did not fail on its own.
    fn mix(&self, side: Side, act: &str) -> Result<(), String> {
        let end =
            Instant::now() + Duration::from_secs(crate::suite::number("JAUS_INTEROP_MIXED", 3));
        let most = crate::suite::number("JAUS_INTEROP_MIXED_OCTETS", usize::MAX as u64) as usize;
        let (actor, answerer) = (self.actor.party, self.answerer.party);
        let can = |scenario: &Scenario| {
            let excuse = actor.excuse_of_actor(*scenario);
            let excuse = excuse.or(answerer.excuse_of_answerer(*scenario));
            let act = scenario.act().filter(|act| actor.act.contains_key(*act));
            let is_hopeful = scenario.octets() <= most && !self.failed.contains(scenario);
            is_hopeful && scenario.side() == Some(side) && excuse.is_none() && act.is_some()
        };
        let others: Vec<Scenario> = Scenario::all().into_iter().filter(can).collect();
        let mut keep = self.keep(act)?;
        while Instant::now() < end {
            for scenario in &others {
                self.try_until_right(*scenario, scenario.act().unwrap_or_default())
                    .map_err(|reason| format!("{}: {reason}", scenario.title()))?;
                keep.forget();
                keep.says(ANSWERED, patience())?;
            }
            if actor.act.contains_key(LOAD) {
                let values = Values {
                    octets: Scenario::Mixed.octets(),
                    ..Values::default()
                };
                self.actor.act(LOAD, &values, LOAD)?.ends(patience())?;
            }
        }
        goes_on(&mut keep)
    }
}

/// Checks that all these words were printed.
fn find_all(words: &[String], said: &str) -> Result<(), String> {
    match words.iter().find(|word| !said.contains(word.as_str())) {
        Some(missing) => Err(format!("{missing} is missing from what was found")),
        None => Ok(()),
    }
}

/// Waits for [`ENOUGH`] answers.
fn goes_on(keep: &mut Process) -> Result<(), String> {
    (0..ENOUGH).try_for_each(|_| keep.says(ANSWERED, patience()))
}
