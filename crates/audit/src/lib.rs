//! The audit log of a JAUS system: who did what, when, and with what result.
//!
//! The log is a file of JSON lines, to which entries are only appended. Refusals have a file of their own,
//! so that noise pushes no evidence out. A full file is renamed, and the oldest files are removed. Each line
//! has a number and the hash of the whole line before it; [`verify`] finds the first line that was changed or
//! is missing. Writing never delays the caller: entries go to a thread of the log through a bounded queue, and
//! what finds no room there is counted and reported in the log.
//!
//! ```
//! use jaus_audit::{Action, AuditLog, AuditSettings, Entry, Outcome};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("audit.jsonl");
//! let log = AuditLog::open(&path, AuditSettings::default())?;
//! log.write(Entry::new("console", Action::ControlRequested, Outcome::Allowed).to("101.1.1"));
//! drop(log); // waits until all is written
//! let line = std::fs::read_to_string(&path)?;
//! assert!(line.contains(r#""who":"console","what":"control requested","to":"101.1.1","result":"allowed""#), "{line}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A repeated refusal, such as each of a thousand refused commands a second, is written once and then
//! counted: at most every ten seconds a line says how often it happened again. What was done by a right is
//! written each time.
#![forbid(unsafe_code)]

mod action;
mod chain;
mod entry;
mod file;
mod forward;
mod log;
mod repeats;
mod stream;
mod verify;

pub use action::Action;
pub use chain::LineHash;
pub use entry::{Entry, Outcome};
pub use file::Limits;
pub use forward::{ForwardError, ForwardTo};
pub use log::{AuditError, AuditLog, AuditSettings, Unwritable, refusals_of};
pub use verify::{BrokenChain, VerifiedLog, VerifyError, verify};
