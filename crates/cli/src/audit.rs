//! Flags and settings of the audit log, which all parts of a program share.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::{Args, ValueEnum};
use jaus::endpoint::Remote;
use jaus::node::{DecisionRecorder, Recorder};
use jaus::rights::Decided;
pub use jaus_audit::AuditLog;
use jaus_audit::{AuditSettings, Entry, ForwardError, ForwardTo, Unwritable};
use jaus_limits::quota_address;
use serde::Deserialize;

use super::failure::Failure;
use super::settings;

#[derive(Args, Debug)]
#[command(next_help_heading = "Audit log")]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct AuditFlags {
    /// Append who did what, and with what result, as JSON lines to this file: refused messages,
    /// control, emergencies, sessions of secure links, logins and requests of the page
    #[arg(long, value_name = "FILE")]
    audit: Option<PathBuf>,

    /// While the audit log cannot be written, go on, or refuse commands and requests for control
    /// [default: go-on]
    #[arg(long, value_name = "WHAT")]
    audit_unwritable: Option<WhenUnwritable>,

    /// Forward the entries of the audit log as well: to journald, or by syslog (RFC 5424, UDP) to this
    /// address, by default to port 514
    #[arg(long, value_name = "PLACE")]
    audit_forward: Option<ForwardTo>,

    /// The log, once it is open.
    #[arg(skip)]
    log: OnceLock<AuditLog>,
}

/// The table `[audit]` of a settings file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Table {
    /// The file of the audit log: refused messages, control, emergencies, sessions of secure links, logins
    /// and requests of the page. Flag: `--audit`.
    file: Option<PathBuf>,
    /// What happens while the log cannot be written, such as on a full disk: `"go-on"`, with an error in
    /// the program's log, or `"refuse-commands"`: only queries and stops are accepted then. Flag:
    /// `--audit-unwritable`.
    unwritable: Option<WhenUnwritable>,
    /// Where entries go besides: `"journald"`, or the address of a syslog server (RFC 5424, UDP), such as
    /// `"10.0.0.5:514"`. Flag: `--audit-forward`.
    forward: Option<Place>,
}

/// What happens while the log cannot be written.
#[derive(Debug, Clone, Copy, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum WhenUnwritable {
    GoOn,
    RefuseCommands,
}

/// A place to forward to.
#[derive(Debug, Deserialize)]
#[serde(try_from = "String")]
struct Place(ForwardTo);

impl TryFrom<String> for Place {
    type Error = ForwardError;

    fn try_from(text: String) -> Result<Self, ForwardError> {
        text.parse().map(Self)
    }
}

impl AuditFlags {
    /// Refuses the flag for the file.
    ///
    /// # Errors
    /// If the flag is there.
    pub(super) fn refuse_flag(&self) -> Result<(), Failure> {
        match &self.audit {
            None => Ok(()),
            Some(_) => Err(Failure::new(
                "this command answers for no component, so it writes no audit log: omit --audit",
            )),
        }
    }

    /// The log that flags or the settings file name; `None` if they name none. It is opened once.
    ///
    /// # Errors
    /// An unreadable settings file, an invalid table, or a log that cannot be written.
    pub fn log(&self, settings: Option<&Path>) -> Result<Option<AuditLog>, Failure> {
        if let Some(log) = self.log.get() {
            return Ok(Some(log.clone()));
        }
        let table: Table = settings
            .map(|file| settings::section(file, settings::AUDIT))
            .transpose()?
            .unwrap_or_default();
        let Some(path) = self.audit.clone().or(table.file) else {
            return Ok(None);
        };
        let unwritable = match self.audit_unwritable.or(table.unwritable) {
            Some(WhenUnwritable::RefuseCommands) => Unwritable::RefuseCommands,
            Some(WhenUnwritable::GoOn) | None => Unwritable::GoOn,
        };
        let forward = table.forward.map(|Place(place)| place);
        let settings = AuditSettings::default()
            .unwritable(unwritable)
            .forward(self.audit_forward.clone().or(forward));
        let log = AuditLog::open(&path, settings).map_err(Failure::of)?;
        Ok(Some(self.log.get_or_init(|| log).clone()))
    }
}

/// The records of plain links in the log.
pub(super) struct PlainLinks(pub(super) AuditLog);

impl DecisionRecorder for PlainLinks {
    fn record(&mut self, decided: Decided<Remote>) {
        // Nobody has proved who sent it.
        let entry = Entry::of("plain link", &decided.decision).times(decided.times);
        self.0.write(match decided.client {
            // With its port, each attempt of a flood would be an entry of its own.
            Remote::Socket(address) => entry.address(quota_address(address.ip())),
            other => entry.address(other),
        });
    }

    fn refuses_commands(&self) -> bool {
        self.0.refuses_commands()
    }
}

/// A recorder of a program that decides itself what its clients may do: they are named with their kind,
/// such as `RA 20.1.70.1`.
#[must_use]
pub fn recorder<C: Display + 'static>(log: AuditLog, kind: &'static str) -> Recorder<C> {
    Recorder::new(Clients { log, kind })
}

/// The records of the clients of a program in the log.
struct Clients {
    log: AuditLog,
    kind: &'static str,
}

impl<C: Display> DecisionRecorder<C> for Clients {
    fn record(&mut self, decided: Decided<C>) {
        let who = format_args!("{} {}", self.kind, decided.client);
        let entry = Entry::of(who, &decided.decision).times(decided.times);
        self.log.write(entry);
    }

    fn refuses_commands(&self) -> bool {
        self.log.refuses_commands()
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use crate::network::Network;

    #[derive(Parser)]
    struct Tool {
        #[command(flatten)]
        network: Network,
    }

    #[tokio::test]
    async fn a_tool_with_the_settings_of_a_service_leaves_it_its_log() {
        let folder = tempfile::tempdir().unwrap();
        let [log, settings] = ["audit.jsonl", "node.toml"].map(|it| folder.path().join(it));
        let table = format!("[audit]\nfile = {:?}\n", log.display().to_string());
        std::fs::write(&settings, table).unwrap();
        let start = |further: &[&str]| {
            let settings = settings.to_str().unwrap();
            let flags = ["tool", "--loopback", "--group=off", "--config", settings];
            let tool = Tool::parse_from(flags.iter().chain(further));
            let (_, config) = tool.network.for_own_node("tool").unwrap();
            let started = tool.network.start(config.clone());
            (started, tool.network.start_service(config))
        };
        let (tool, service) = start(&[]);
        assert!(tool.is_ok(), "{:?}", tool.err());
        assert!(log.exists() && service.is_ok());
        let (tool, other) = start(&[]);
        assert!(tool.is_ok(), "{:?}", tool.err());
        let error = other.err().unwrap().to_string();
        assert!(error.contains("another program writes to it"), "{error}");
        let mine = folder.path().join("mine.jsonl");
        let (tool, _) = start(&["--audit", mine.to_str().unwrap()]);
        assert!(tool.err().unwrap().to_string().contains("omit --audit"));
    }
}
