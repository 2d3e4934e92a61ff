//! The interoperability suite: selects the encounters, runs them and reports.

mod encounter;
mod hosts;
mod ours;
mod party;
mod process;
mod report;
mod scenario;
mod scripted;
mod settings;
mod verdict;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use jaus_test_kit::hosts::on_hosts_for;

use hosts::Hosts;
use scenario::Scenario;
use settings::Party;
use verdict::{Column, Verdict};

/// The default peers of the subject.
const PEERS: &str = "ours,scripted-jauspp,scripted-junior,scripted-judge";
/// The one test of this binary.
const TEST: &str = "interop";

/// Executes the command line: that of cargo, or a role in which this suite restarts itself.
pub(crate) fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, role @ ..] = &arguments[..]
        && flag == "--role"
    {
        return ours::play(role);
    }
    if arguments.iter().any(|argument| argument == "--list") {
        println!("{TEST}: test");
        return ExitCode::SUCCESS;
    }
    let is_filter = |argument: &&String| !argument.starts_with('-');
    let mut filters = arguments.iter().filter(is_filter).peekable();
    if filters.peek().is_some() && !filters.any(|filter| TEST.contains(filter.as_str())) {
        return ExitCode::SUCCESS;
    }
    // The process in the other namespace reports its own result.
    let mut is_right = true;
    on_hosts_for(TEST, Hosts::new, |_| is_right = try_all());
    ExitCode::from(u8::from(!is_right))
}

/// Runs every scenario with every peer. Returns whether none failed.
fn try_all() -> bool {
    match run() {
        Ok(is_right) => is_right,
        Err(error) => {
            eprintln!("{TEST}: {error}");
            false
        }
    }
}

fn run() -> Result<bool, String> {
    let subject = Party::load(&setting("JAUS_INTEROP_SUBJECT", "ours"))?;
    let peers = setting("JAUS_INTEROP_PEER", PEERS);
    let peers: Result<Vec<Party>, String> = peers.split(',').map(Party::load).collect();
    let (peers, scenarios) = (peers?, chosen()?);
    let directory = directory()?;
    let versions = versions(&subject, &peers);
    let columns = meet(&subject, &peers, &scenarios, &directory)?;
    let table = report::write(&directory, &versions, &columns)
        .map_err(|error| format!("{}: {error}", directory.display()))?;
    println!(
        "\n{table}\nThis table and report.xml are in {}",
        directory.display()
    );
    let mut cells = columns.iter().flat_map(|column| &column.cells);
    Ok(!cells.any(|cell| matches!(cell.verdict, Verdict::Failed(_))))
}

/// Runs both directions with every peer, all in parallel, except the two directions of a peer that
/// is marked `alone`.
fn meet(
    subject: &Party,
    peers: &[Party],
    scenarios: &[Scenario],
    directory: &Path,
) -> Result<Vec<Column>, String> {
    let meet = |peer: &Party, is_asked: bool| {
        let (actor, answerer) = if is_asked {
            (subject, peer)
        } else {
            (peer, subject)
        };
        let direction = if is_asked { "asked" } else { "asking" };
        let directory = directory.join(file_name(&peer.name)).join(direction);
        encounter::run((&peer.name, actor, answerer), scenarios, &directory)
    };
    std::thread::scope(|scope| {
        let mut running = Vec::new();
        for peer in peers {
            // A peer meets itself only once.
            let directions = if peer.name == subject.name {
                vec![true]
            } else {
                vec![true, false]
            };
            if peer.alone {
                running.push(
                    scope.spawn(move || directions.iter().map(|one| meet(peer, *one)).collect()),
                );
            } else {
                let each = directions.into_iter();
                running.extend(each.map(|one| scope.spawn(move || vec![meet(peer, one)])));
            }
        }
        let finished = running.into_iter().map(|thread| thread.join());
        let all: Result<Vec<Vec<_>>, _> = finished.collect();
        all.map_err(|_| "a part of the suite has panicked".to_owned())?
            .into_iter()
            .flatten()
            .collect()
    })
}

/// The versions that the parties report.
fn versions(subject: &Party, peers: &[Party]) -> Vec<report::Version> {
    let mut versions: Vec<report::Version> = Vec::new();
    for party in std::iter::once(subject).chain(peers) {
        if versions.iter().all(|(name, _)| *name != party.name) {
            versions.push((party.name.clone(), party::version(party)));
        }
    }
    versions
}

/// The selected scenarios: all, or those whose keys start with one of the prefixes in
/// `JAUS_INTEROP_ONLY`.
fn chosen() -> Result<Vec<Scenario>, String> {
    let only = setting("JAUS_INTEROP_ONLY", "");
    let wanted: Vec<&str> = only.split(',').filter(|key| !key.is_empty()).collect();
    let is_wanted = |scenario: &Scenario| {
        wanted.is_empty() || wanted.iter().any(|key| scenario.key().starts_with(key))
    };
    let chosen: Vec<Scenario> = Scenario::all().into_iter().filter(is_wanted).collect();
    if chosen.is_empty() {
        let keys: Vec<String> = Scenario::all().into_iter().map(Scenario::key).collect();
        return Err(format!(
            "JAUS_INTEROP_ONLY: no scenario `{only}`; there are: {}",
            keys.join(", ")
        ));
    }
    Ok(chosen)
}

/// The directory of the results.
fn directory() -> Result<PathBuf, String> {
    let usual = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("interop");
    let directory = std::env::var_os("JAUS_INTEROP_OUT").map_or(usual, PathBuf::from);
    std::fs::create_dir_all(&directory)
        .map_err(|error| format!("{}: {error}", directory.display()))?;
    Ok(directory)
}

/// A name as a file name.
fn file_name(name: &str) -> String {
    let allowed = |character: char| {
        if character.is_alphanumeric() {
            character
        } else {
            '-'
        }
    };
    name.to_lowercase().chars().map(allowed).collect()
}

/// An environment variable, or its default.
fn setting(name: &str, usual: &str) -> String {
    std::env::var(name)
        .ok()
        .filter(|value| !value.is_empty())
        .unwrap_or_else(|| usual.to_owned())
}

/// A number from the environment, or its default.
fn number(name: &str, usual: u64) -> u64 {
    let value = setting(name, &usual.to_string());
    value
        .parse()
        .unwrap_or_else(|_| panic!("{name}={value} is not a whole number of seconds"))
}
