//! The audit log of a JAUS system: who did what, when, and with what result.
//!
//! The log is a file of JSON lines, to which entries are only appended. A full file is renamed, and
//! the oldest files are removed. Writing never delays the caller: entries go to a thread of the log
//! through a bounded queue, and what finds no room there is counted and reported in the log.
//!
//! ```
//! use jaus_audit::{AuditLog, Entry, Limits, Outcome};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("audit.jsonl");
//! let log = AuditLog::open(&path, Limits::default())?;
//! log.write(Entry::new("console", "RequestControl", Outcome::Refused).to("101.1.1").because("authority 200, at most 127"));
//! drop(log); // waits until all is written
//! let line = std::fs::read_to_string(&path)?;
//! assert!(line.contains(r#""who":"console","what":"RequestControl","to":"101.1.1","result":"refused""#), "{line}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A repeated entry, such as each of a thousand refused commands a second, is written once and then
//! counted: at most every ten seconds a line says how often it happened again.
#![forbid(unsafe_code)]

mod entry;
mod file;
mod log;
mod repeats;

pub use entry::{Entry, Outcome};
pub use file::Limits;
pub use log::{AuditError, AuditLog};
