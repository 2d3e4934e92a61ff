//! `jaus watch`: prints the messages of a node, live or from its log, one per line.

mod files;
mod live;
mod tally;

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, colours_wanted};
use jaus_cli::runtime;
use jaus_view::{Entry, Filter};

use crate::definitions::Jsidl;
use tally::Tally;

/// Show the messages that pass through a node, live or from files, reassembled and without
/// duplicates
///
/// Live messages come from a communicator's debug view. A viewer that is too slow loses lines, and
/// their number is shown. Files are captures (from a communicator's --log, `jaus record`, Wireshark
/// …), JSON lines, or directories with a communicator's log.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus watch\n  \
    jaus watch --component 101.2.33 --message Velocity\n  \
    jaus watch --message ReportVelocityState --field 'velocity_x>1.0'\n  \
    jaus watch --at 127.0.0.1:9000 --json | grep 4404\n  \
    jaus watch /var/log/jaus --stats\n  \
    jaus watch drive.pcapng --filter 'from=101 to=42 service=Pose state!=ready'\n\n\
    A message must match all terms of a filter: component=, from=, to= (101.2.33, 101.2, 101 or \
    101.*.33), service=, message= (part of the name, the whole name with *, or the code), \
    direction= (received, sent, local, passing), text=, and fields by name with = != < <= > >= or \
    ~ (contains). Commas separate alternatives; names ignore case and underscores.")]
pub(crate) struct Watch {
    /// Files or directories to read instead of the live view
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,

    /// The address of a debug view
    #[arg(
        long,
        value_name = "ADDRESS",
        default_value = "127.0.0.1:8794",
        conflicts_with = "files"
    )]
    at: String,

    /// From or to this component, node or subsystem: 101.2.33, 101.2, 101 (this and the following
    /// are repeatable; a message must match all)
    #[arg(long, value_name = "ID")]
    component: Vec<String>,

    /// From this component, node or subsystem
    #[arg(long, value_name = "ID")]
    from: Vec<String>,

    /// To this component, node or subsystem
    #[arg(long, value_name = "ID")]
    to: Vec<String>,

    /// Of services whose URN contains this
    #[arg(long, value_name = "NAME")]
    service: Vec<String>,

    /// With this message code, or a name that contains this (or matches it, with *)
    #[arg(long, value_name = "NAME")]
    message: Vec<String>,

    /// Received, sent, local (within the node) or passing (forwarded); only for the live view and
    /// JSON lines
    #[arg(long, value_name = "WAY")]
    direction: Vec<String>,

    /// With a matching field: 'velocity_x>1.0', state=ready, 'pose.x!=0', name~bat
    #[arg(long, value_name = "COMPARISON")]
    field: Vec<String>,

    /// Whose JSON line contains this
    #[arg(long, value_name = "TEXT")]
    text: Vec<String>,

    /// A whole filter; see below
    #[arg(long, value_name = "TERMS")]
    filter: Vec<String>,

    /// Print each message as a JSON object
    #[arg(long)]
    json: bool,

    /// Print only the number of messages of each type, at the end
    #[arg(long)]
    stats: bool,

    #[command(flatten)]
    jsidl: Jsidl,

    /// End after this time [default: at Ctrl-C, or at the end of the files]
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration)]
    duration: Option<Duration>,
}

impl Watch {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let filter = self.filter()?;
        let mut printer = Printer {
            output: Output::new(),
            form: match (self.stats, self.json) {
                (true, _) => Form::Tally(Tally::default()),
                (false, true) => Form::Json,
                (false, false) => Form::Words {
                    colours: colours_wanted(&std::io::stdout()),
                },
            },
        };
        let outcome = if self.files.is_empty() {
            live::watch(&self.at, &filter, self.duration, &mut printer)?
        } else {
            let dictionary = self.jsidl.load()?;
            files::watch(&self.files, &filter, &dictionary, &mut printer)?
        };
        if let Form::Tally(tally) = &printer.form {
            for line in tally.lines() {
                printer.output.line(line)?;
            }
        }
        Ok(outcome)
    }

    fn filter(&self) -> Result<Filter, Failure> {
        let mut filter = Filter::default();
        for (key, values) in [
            ("component", &self.component),
            ("from", &self.from),
            ("to", &self.to),
            ("service", &self.service),
            ("message", &self.message),
            ("direction", &self.direction),
            ("field", &self.field),
            ("text", &self.text),
            ("filter", &self.filter),
        ] {
            for value in values {
                let added = filter.add(key, value);
                added.map_err(|error| Failure::new(format!("--{key} {value}: {error}")))?;
            }
        }
        Ok(filter)
    }
}

/// Prints or counts messages.
struct Printer {
    output: Output,
    form: Form,
}

enum Form {
    Words { colours: bool },
    Json,
    Tally(Tally),
}

impl Printer {
    fn entry(&mut self, entry: &Entry) -> Result<(), Failure> {
        match &mut self.form {
            Form::Words { colours } => self.output.line(entry.in_words(*colours)),
            Form::Json => self.output.line(entry.to_json()),
            Form::Tally(tally) => {
                tally.add(entry);
                Ok(())
            }
        }
    }

    /// Reports lost messages.
    fn lost(&mut self, count: u64) -> Result<(), Failure> {
        match &mut self.form {
            Form::Words { .. } => self
                .output
                .line(format_args!("… {count} lost: this viewer is too slow")),
            Form::Json => self.output.line(format_args!("{{\"lost\":{count}}}")),
            Form::Tally(tally) => {
                tally.lose(count);
                Ok(())
            }
        }
    }

    /// Prints an object written for people: a message, or a number of lost ones.
    fn object(&mut self, entry: &Entry) -> Result<(), Failure> {
        match lost_in(entry) {
            Some(count) => self.lost(count),
            None => self.entry(entry),
        }
    }
}

/// The number of lost messages, if the object reports one.
fn lost_in(entry: &Entry) -> Option<u64> {
    entry.json().get("lost")?.as_u64()
}
