//! A party on its host: its processes and the text of its commands.

use std::path::{Path, PathBuf};
use std::time::Duration;

use jaus::address::JausId;

use crate::suite::hosts::{Host, Hosts, INTERFACE};
use crate::suite::process::Process;
use crate::suite::settings::{Party, Side, Start, with_environment};

/// Timeout of any wait. Reached only when something fails.
pub(crate) fn patience() -> Duration {
    Duration::from_secs(crate::suite::number("JAUS_INTEROP_PATIENCE", 40))
}

/// A party on its host.
#[derive(Debug)]
pub(crate) struct Place<'a> {
    pub(crate) party: &'a Party,
    other: &'a Party,
    host: Host,
    hosts: &'a Hosts,
    /// Directory of the logs of its processes.
    logs: PathBuf,
    background: Vec<Process>,
    side: Option<(Side, Process)>,
}

impl<'a> Place<'a> {
    pub(crate) fn new(
        party: &'a Party,
        other: &'a Party,
        host: Host,
        hosts: &'a Hosts,
        logs: &Path,
    ) -> Self {
        Self {
            party,
            other,
            host,
            hosts,
            logs: logs.to_owned(),
            background: Vec::new(),
            side: None,
        }
    }

    /// Starts the background processes and, for an answering party, the wanted side.
    pub(crate) fn be(&mut self, wanted: Option<Side>) -> Result<(), String> {
        self.prepare()?;
        let Some(wanted) = wanted else {
            return Ok(());
        };
        if let Some((side, process)) = &mut self.side
            && *side == wanted
            && !process.has_ended()
        {
            return Ok(());
        }
        self.leave();
        let start = self
            .party
            .side
            .get(&wanted)
            .ok_or("there is no such side")?;
        let process = self.run(start, &format!("{wanted:?}").to_lowercase())?;
        self.side = Some((wanted, process));
        Ok(())
    }

    /// Starts the background processes that are not running.
    fn prepare(&mut self) -> Result<(), String> {
        self.background.retain_mut(|process| !process.has_ended());
        if self.background.len() < self.party.background.len() {
            self.background.clear();
            for start in &self.party.background {
                let process = self.run(start, "background")?;
                self.background.push(process);
            }
        }
        Ok(())
    }

    /// Ends the answering process.
    pub(crate) fn leave(&mut self) {
        self.side = None;
    }

    /// Kills all its processes, as a power cut would. Returns the side that was running.
    pub(crate) fn crash(&mut self) -> Option<Side> {
        self.hosts.cut_power(self.host);
        self.background.clear();
        self.side.take().map(|(side, _)| side)
    }

    /// An error text if the answering process has ended by itself.
    pub(crate) fn trouble(&mut self) -> Option<String> {
        let (side, process) = self.side.as_mut()?;
        let has_ended = process.has_ended();
        has_ended.then(|| format!("{side} of {} has ended by itself", self.party.name))
    }

    /// Starts an act against the other party.
    pub(crate) fn act(&self, act: &str, values: &Values, log: &str) -> Result<Process, String> {
        let command = self.party.act.get(act).ok_or("there is no such act")?;
        self.spawn(command, values, log)
    }

    fn run(&self, start: &Start, log: &str) -> Result<Process, String> {
        let mut process = self.spawn(&start.command, &Values::default(), log)?;
        if let Some(ready) = &start.ready {
            process.says(ready, patience())?;
        }
        Ok(process)
    }

    fn spawn(&self, command: &[String], values: &Values, log: &str) -> Result<Process, String> {
        let command: Result<Vec<String>, String> = command
            .iter()
            .map(|word| self.filled(word, values))
            .collect();
        let log = self.logs.join(format!("{log}.log"));
        Process::start(&self.hosts.name(self.host), &command?, &log)
    }

    /// A word of a command with its placeholders replaced.
    fn filled(&self, word: &str, values: &Values) -> Result<String, String> {
        let other_host = match self.host {
            Host::Actor => Host::Answerer,
            Host::Answerer => Host::Actor,
        };
        let other = match self.host {
            Host::Actor => self.other.id,
            Host::Answerer => self.other.actor,
        };
        let sensor = self.other.sensor.unwrap_or(other);
        let own = std::env::current_exe().map_err(|error| error.to_string())?;
        let places = [
            ("{jaus}", env!("CARGO_BIN_EXE_jaus").to_owned()),
            ("{self}", own.display().to_string()),
            ("{peers}", crate::suite::settings::PEERS.to_owned()),
            ("{logs}", self.logs.display().to_string()),
            ("{id}", self.party.id.to_string()),
            ("{id:x}", hexadecimal(self.party.id)),
            ("{actor}", self.party.actor.to_string()),
            ("{actor:x}", hexadecimal(self.party.actor)),
            ("{other}", other.to_string()),
            ("{other:x}", hexadecimal(other)),
            ("{other-sensor}", sensor.to_string()),
            ("{needs}", self.other.needs.clone()),
            ("{address}", self.host.address().to_owned()),
            ("{other-address}", other_host.address().to_owned()),
            ("{interface}", INTERFACE.to_owned()),
            ("{size}", values.octets.to_string()),
            ("{seconds}", values.seconds.to_string()),
        ];
        let filled = places.iter().fold(word.to_owned(), |word, (place, value)| {
            word.replace(place, value)
        });
        with_environment(&filled)
    }
}

/// Values that change from act to act.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Values {
    /// The size of a message.
    pub(crate) octets: usize,
    /// Timeout.
    pub(crate) seconds: u64,
}

impl Default for Values {
    fn default() -> Self {
        Self {
            octets: 0,
            seconds: patience().as_secs(),
        }
    }
}

/// An id as one hexadecimal number, as some programs expect it.
fn hexadecimal(id: JausId) -> String {
    format!(
        "0x{:04X}{:02X}{:02X}",
        id.subsystem(),
        id.node(),
        id.component()
    )
}

/// The version that a party reports: the first line that its version command prints.
pub(crate) fn version(party: &Party) -> String {
    let Some((program, arguments)) = party.version.split_first() else {
        return "no version command".to_owned();
    };
    let filled =
        |word: &String| with_environment(&word.replace("{jaus}", env!("CARGO_BIN_EXE_jaus")));
    let run = || -> Result<String, String> {
        let arguments: Result<Vec<String>, String> = arguments.iter().map(filled).collect();
        let output = std::process::Command::new(filled(program)?)
            .args(arguments?)
            .output();
        let output = output.map_err(|error| error.to_string())?;
        let said = String::from_utf8_lossy(&output.stdout);
        Ok(said.lines().next().unwrap_or("nothing").trim().to_owned())
    };
    run().unwrap_or_else(|error| format!("version not known: {error}"))
}
