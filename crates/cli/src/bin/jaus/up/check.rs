//! `jaus up --check`: prints what would be started, and has our own programs check their flags.

use std::io;
use std::path::Path;
use std::process::{Command, Stdio};

use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, counted};

use super::system::{Part, System};

/// Prints what would be started, or the mistakes in the flags.
pub(super) fn check(file: &Path, system: &System) -> Result<Outcome, Failure> {
    let wrong = system.parts.iter().filter_map(|part| {
        let mistake = mistake_in_flags(part)?;
        Some(format!(
            "{}:{}: [parts.{}]: {mistake}",
            file.display(),
            part.line,
            part.name
        ))
    });
    let wrong: Vec<String> = wrong.collect();
    if !wrong.is_empty() {
        return Err(Failure::new(wrong.join("\njaus: ")));
    }
    let mut output = Output::new();
    for part in &system.parts {
        output.line(format_args!("{}: {}", part.name, command_line(part)))?;
        if let Some(directory) = &part.directory {
            output.line(format_args!("    in {}", directory.display()))?;
        }
        for (name, value) in &part.environment {
            output.line(format_args!("    with {name}={value}"))?;
        }
    }
    let parts = counted(system.parts.len(), "part");
    output.line(format_args!("{parts}, no errors"))?;
    Ok(Outcome::Done)
}

/// The mistake that one of our own programs finds in its flags: it parses them before `--help`, and
/// then ends. Other programs may have side effects and are not run.
fn mistake_in_flags(part: &Part) -> Option<String> {
    let name = part.program.file_name()?.to_str()?;
    if name != "jaus" && !name.starts_with("jaus-") {
        return None;
    }
    let asked = Command::new(&part.program)
        .args(&part.arguments)
        .arg("--help")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .output();
    match asked {
        Ok(output) if output.status.success() => None,
        Ok(output) => Some(in_one_line(&String::from_utf8_lossy(&output.stderr))),
        Err(error) => Some(cannot_run(&error)),
    }
}

fn cannot_run(error: &io::Error) -> String {
    format!("cannot start its program: {error}")
}

/// The error message on flags, without the usage text.
fn in_one_line(complaint: &str) -> String {
    let lines = complaint.lines().map(str::trim);
    let told = lines
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"))
        .filter(|line| !line.is_empty());
    let told: Vec<&str> = told.collect();
    let told = told.join("; ");
    told.strip_prefix("error: ").unwrap_or(&told).to_owned()
}

/// The command line as a user would type it.
fn command_line(part: &Part) -> String {
    let program = part.program.display().to_string();
    let words = std::iter::once(&program).chain(&part.arguments);
    let quoted = words.map(|word| {
        let plain = |c: char| c.is_alphanumeric() || "-_=./:,@+%".contains(c);
        match !word.is_empty() && word.chars().all(plain) {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', "'\\''")),
        }
    });
    quoted.collect::<Vec<_>>().join(" ")
}
