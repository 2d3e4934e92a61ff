//! Outputs of a run: the report or JSON lines on standard output, and files.

use std::fs::{self, File};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use jaus_cli::failure::Failure;
use jaus_cli::output::{self, Output};
use jaus_cli::runtime::Clock;
use jaus_view::Dictionary;

use super::report::Report;
use super::script::service::Services;
use super::step::{Form, Step};
use super::subject::Subject;
use super::verdict::{StepResult, Tally};
use super::{Judge, json, junit};

/// All output files and streams of a run.
pub(super) struct Outputs<'d> {
    dictionary: &'d Dictionary,
    report: Report<'d>,
    output: Output,
    /// Whether standard output has the report; otherwise it has JSON lines.
    readable: bool,
    /// Whether standard output is a terminal.
    watched: bool,
    everything: bool,
    json: Option<(PathBuf, BufWriter<File>)>,
    junit: Option<PathBuf>,
    /// Origin of the steps.
    against: String,
    clock: Clock,
    tally: Tally,
    results: Vec<StepResult>,
}

impl<'d> Outputs<'d> {
    pub(super) fn open(
        judge: &Judge,
        services: &Services,
        dictionary: &'d Dictionary,
    ) -> Result<Self, Failure> {
        let to_stdout = judge.json.as_deref() == Some(Path::new("-"));
        let json = judge.json.as_deref().filter(|_| !to_stdout);
        let create = |path: &Path| match File::create(path) {
            Ok(file) => Ok((path.to_owned(), BufWriter::new(file))),
            Err(error) => Err(Failure::file(path, &error)),
        };
        let json = json.map(create).transpose()?;
        let stdout = io::stdout();
        let colours = output::colours_wanted(&stdout);
        Ok(Self {
            dictionary,
            report: Report::new(dictionary, colours),
            output: Output::new(),
            readable: !to_stdout,
            watched: stdout.is_terminal() && !to_stdout,
            everything: judge.all,
            json,
            junit: judge.junit.clone(),
            against: services.origin(),
            clock: Clock::start(),
            tally: Tally::default(),
            results: Vec::new(),
        })
    }

    pub(super) fn begin(&mut self, subject: &Subject) -> Result<(), Failure> {
        self.lines(&self.report.subject(subject))
    }

    pub(super) fn form(&mut self, form: Form) -> Result<(), Failure> {
        let heading = self.report.form(form);
        self.lines(&[String::new(), heading])
    }

    /// Shows a person at the terminal which step is running.
    pub(super) fn step_begins(&mut self, step: &Step) -> Result<(), Failure> {
        if !self.watched {
            return Ok(());
        }
        let running = format!("  …        {:<3}  {}", step.name, step.title);
        self.output.part(&running)
    }

    pub(super) fn step_ends(&mut self, result: StepResult) -> Result<(), Failure> {
        if self.watched {
            // Clears the line.
            self.output.part("\r\x1b[K")?;
        }
        self.tally.count(&result);
        self.lines(&self.report.step(&result, self.everything))?;
        let line = json::step(self.dictionary, &result);
        self.json(&line)?;
        self.results.push(result);
        Ok(())
    }

    /// Finishes all outputs. Returns whether the subject conforms.
    pub(super) fn end(mut self, subject: &Subject) -> Result<bool, Failure> {
        let took = self.clock.elapsed();
        let end = self.report.end(subject, &self.tally, &self.against, took);
        self.lines(&end)?;
        self.json(&json::end(subject, &self.tally, &self.against))?;
        if let Some((path, file)) = &mut self.json {
            let flushed = file.flush();
            flushed.map_err(|error| Failure::file(path, &error))?;
        }
        if let Some(path) = &self.junit {
            // Build servers show no colours.
            let report = Report::new(self.dictionary, false);
            let document = junit::document(&report, subject, &self.results);
            fs::write(path, document).map_err(|error| Failure::file(path, &error))?;
        }
        Ok(self.tally.conforms())
    }

    fn lines(&mut self, lines: &[String]) -> Result<(), Failure> {
        if !self.readable {
            return Ok(());
        }
        lines.iter().try_for_each(|line| self.output.line(line))
    }

    fn json(&mut self, line: &str) -> Result<(), Failure> {
        match &mut self.json {
            Some((path, file)) => {
                writeln!(file, "{line}").map_err(|error| Failure::file(path, &error))
            }
            None if self.readable => Ok(()),
            None => self.output.line(line),
        }
    }
}
