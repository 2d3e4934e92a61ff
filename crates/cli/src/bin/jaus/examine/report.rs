//! Report of an examination, as text and as JSON.

use jaus_cli::failure::Outcome;
use jaus_cli::output::{counted, wrapped};
use serde_json::{Value as Json, json};

use super::case::Case;
use super::exchange::{Mark, Trial};

/// Columns before the text: mark and exchange.
const INDENT: usize = 28;

/// A trial, wrapped. After a basic failure, the first line stands for all remaining trials.
pub(super) fn line(trial: &Trial, before: Option<&Trial>, colours: bool) -> Option<String> {
    let cut_off = trial.verdict.cut_off;
    if cut_off && before.is_some_and(|before| before.verdict.cut_off) {
        return None;
    }
    let verdict = &trial.verdict;
    let name = verdict.mark.name();
    let mark = match colours {
        true => format!("{}{name:8}\x1b[0m", colour(verdict.mark)),
        false => format!("{name:8}"),
    };
    let what = wrapped(&format!("{}{}", verdict.what, time(trial)), INDENT);
    let tried = if cut_off {
        "the rest"
    } else {
        trial.exchange.name()
    };
    let mut text = format!("{mark} {tried:18} {what}");
    for (sign, more) in [("?", &verdict.cause), ("→", &verdict.remedy)] {
        if let Some(more) = more {
            let more = wrapped(&format!("{sign} {more}"), INDENT);
            text.push_str(&format!("\n{:INDENT$}{more}", ""));
        }
    }
    Some(text)
}

/// Its duration, if it waited.
fn time(trial: &Trial) -> String {
    let asked = trial.verdict.mark != Mark::Skipped && !trial.took.is_zero();
    let milliseconds = trial.took.as_secs_f64() * 1e3;
    if asked {
        format!(" ({milliseconds:.1}\u{a0}ms)")
    } else {
        String::new()
    }
}

const fn colour(mark: Mark) -> &'static str {
    match mark {
        Mark::Ok => "\x1b[32m",
        Mark::Failed => "\x1b[31m",
        Mark::Skipped => "\x1b[2m",
    }
}

/// The recognised profile, with the evidence.
pub(super) fn profile(case: &Case) -> String {
    let lines = case.profile().in_words(case);
    let mut text = String::new();
    for (number, line) in lines.iter().enumerate() {
        let label = if number == 0 { "profile" } else { "" };
        let start = if number == 0 { "" } else { "\n" };
        text.push_str(&format!("{start}{label:INDENT$}{}", wrapped(line, INDENT)));
    }
    text
}

/// The conclusion.
pub(super) fn conclusion(case: &Case, whole: bool) -> String {
    let count = |mark| {
        case.trials
            .iter()
            .filter(|t| t.verdict.mark == mark)
            .count()
    };
    let (ok, failed, skipped) = (count(Mark::Ok), count(Mark::Failed), count(Mark::Skipped));
    let counts = format!("{ok} ok, {failed} failed, {skipped} skipped");
    let ended = if whole {
        ""
    } else {
        " before the interruption"
    };
    match case.trials.iter().find(|trial| trial.failed()) {
        None => format!("All is well{ended}: {counts}."),
        Some(first) => format!(
            "{} failed{ended}, the first: {}. ({counts})\n{}",
            counted(failed, "exchange"),
            first.exchange.name(),
            wrapped(
                &format!(
                    "Likely cause: {}.",
                    first.verdict.cause.as_deref().unwrap_or("unknown")
                ),
                0
            ),
        ),
    }
}

pub(super) fn to_json(case: &Case, whole: bool) -> Json {
    let first = case.trials.iter().find(|trial| trial.failed());
    json!({
        "peer": case.settings.target.to_string(),
        "id": case.id.map(|id| id.to_string()),
        "address": case.address.map(|address| address.to_string()),
        "name": case.name,
        "asked_as": case.settings.own.to_string(),
        "profile": case.profile().to_json(),
        "complete": whole,
        "first_failure": first.map(|trial| trial.exchange.name()),
        "likely_cause": first.and_then(|trial| trial.verdict.cause.clone()),
        "remedy": first.and_then(|trial| trial.verdict.remedy.clone()),
        "not_kept": case.seen.dropped(),
        "exchanges": case.trials.iter().map(Trial::to_json).collect::<Vec<_>>(),
    })
}

/// The exit status.
pub(super) fn outcome(case: &Case, whole: bool) -> Outcome {
    let failed = case.trials.iter().any(|trial| trial.failed());
    Outcome::complete_if(whole && !failed)
}
