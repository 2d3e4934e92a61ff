//! `jaus watch`: prints messages, one per line: those of a node, of network interfaces or of files.

mod files;
mod interfaces;
mod live;
mod tally;

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use jaus::link::Group;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, colours_wanted};
use jaus_cli::runtime;
use jaus_view::{Dictionary, Entry, Filter};

use crate::debug_view::usual_address;
use crate::definitions::Jsidl;
use tally::Tally;

/// Show the messages that pass through a node or a network interface, or those of files, reassembled
/// and without duplicates
///
/// Live messages come from a communicator's debug view. A viewer that is too slow loses lines, and
/// their number is shown. With --interface they come from the network itself, without a
/// communicator: with the privilege to open packet sockets (root, or `setcap cap_net_raw+ep jaus`)
/// all traffic of this host whose content is JAUS, otherwise the multicast group. Files are captures
/// (from a communicator's --log, `jaus record`, Wireshark …), JSON lines, or directories with a
/// communicator's log. With --jsidl, messages that the communicator could not decode are decoded here.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus watch\n  \
    jaus watch --component 101.2.33 --message Velocity\n  \
    jaus watch --message ReportVelocityState --field 'velocity_x>1.0'\n  \
    jaus watch --interface all\n  \
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

    /// The address of a debug view: the path of its socket, or ADDRESS:PORT [default: that of this
    /// user's communicator]
    #[arg(long, value_name = "ADDRESS", conflicts_with = "files")]
    at: Option<String>,

    /// Watch this network interface, by name or address, instead of a debug view (repeatable);
    /// `all` for all of them, including loopback
    #[arg(long, value_name = "INTERFACE", conflicts_with_all = ["files", "at"])]
    interface: Vec<String>,

    /// The multicast group to watch without packet sockets
    #[arg(long, value_name = "ADDRESS", default_value_t, requires = "interface")]
    group: Group,

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

    /// End after this time [default: at Ctrl-C]; not for files
    #[arg(long = "for", value_name = "DURATION", value_parser = runtime::duration, conflicts_with = "files")]
    duration: Option<Duration>,
}

impl Watch {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let filter = self.filter()?;
        let dictionary = self.jsidl.load()?;
        let mut printer = Printer {
            output: Output::new(),
            dictionary: &dictionary,
            form: match (self.stats, self.json) {
                (true, _) => Form::Tally(Tally::default()),
                (false, true) => Form::Json,
                (false, false) => Form::Words {
                    colours: colours_wanted(&std::io::stdout()),
                },
            },
        };
        let outcome = self.watch(&filter, &mut printer)?;
        if let Form::Tally(tally) = &printer.form {
            for line in tally.lines() {
                printer.output.line(line)?;
            }
        }
        Ok(outcome)
    }

    fn watch(&self, filter: &Filter, printer: &mut Printer<'_>) -> Result<Outcome, Failure> {
        if !self.files.is_empty() {
            return files::watch(&self.files, filter, printer);
        }
        let limit = self.duration;
        if self.interface.is_empty() {
            let filters_here = self.jsidl.is_given();
            let at = self.at.clone().unwrap_or_else(usual_address);
            return live::watch(&at, filter, filters_here, limit, printer);
        }
        let chosen: &[String] = match self.interface.iter().any(|name| name == "all") {
            true => &[],
            false => &self.interface,
        };
        interfaces::watch(chosen, self.group, filter, limit, printer)
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
struct Printer<'d> {
    output: Output,
    dictionary: &'d Dictionary,
    form: Form,
}

enum Form {
    Words { colours: bool },
    Json,
    Tally(Tally),
}

impl Printer<'_> {
    fn entry(&mut self, entry: &Entry) -> Result<(), Failure> {
        match &mut self.form {
            Form::Words { colours } => {
                let words = entry.in_words(self.dictionary, *colours);
                self.output.line(words)
            }
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

/// Prints the number of lost messages, if a line of JSON is one, whatever the filter.
fn tell_lost(line: &str, printer: &mut Printer<'_>) -> Result<(), Failure> {
    let object = serde_json::from_str(line).ok();
    match object.map(Entry::of_object).as_ref().and_then(lost_in) {
        Some(count) => printer.lost(count),
        None => Ok(()),
    }
}

/// The number of lost messages, if the object reports one.
fn lost_in(entry: &Entry) -> Option<u64> {
    entry.json().get("lost")?.as_u64()
}
