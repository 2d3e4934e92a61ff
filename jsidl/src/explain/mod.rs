//! Explains the octets of a message one by one: which field each belongs to, what it says, and
//! where reading stopped if something is wrong.
//!
//! [`explain`] looks the message up by its code and makes the [`Row`]s; [`table`] prints them as an
//! annotated hex dump. Every octet is in exactly one row, and the rows are in order.
//!
//! ```
//! let mut loader = jsidl::Loader::new();
//! loader.catalogue();
//! let library = loader.load().library;
//!
//! let explained = jsidl::explain::explain(&library, &[0x00, 0x2B, 0x02], None)?;
//! assert_eq!(explained.message, "QueryIdentification");
//! assert_eq!(explained.rows[1].field, "QueryType");
//! assert_eq!(explained.rows[1].octets, [0x02]);
//! # Ok::<(), jsidl::explain::Unexplained>(())
//! ```

mod choose;
#[cfg(feature = "json")]
mod json;
mod row;
mod rows;
mod table;

use crate::dynamic::{DecodeError, Limits, decode_traced};
use crate::model::{Id, Message};

pub use choose::{ServiceName, Unexplained, explain};
pub use row::{Kind, Row};
pub use table::table;

/// A message, octet by octet.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The message's name.
    pub message: String,
    /// Its code.
    pub code: u16,
    /// The service that defines it.
    pub service: Id,
    /// All octets in order; what was not read is in the last row.
    pub rows: Vec<Row>,
    /// Where reading stopped and why, if it did. Its offset counts from the message code.
    pub stop: Option<DecodeError>,
    /// Services that define other messages with the same code, which would be read differently.
    pub others: Vec<Id>,
}

impl Explanation {
    /// Lets the rows count from an octet before the message: for a message in a datagram.
    #[must_use]
    pub fn shifted(mut self, by: usize) -> Self {
        for row in &mut self.rows {
            row.offset += by;
        }
        self
    }
}

/// The rows of octets that are read by this definition, and where and why reading stopped.
///
/// Counts outside the limits of the definition are noted and do not stop it.
pub fn explain_as(message: &Message, octets: &[u8]) -> (Vec<Row>, Option<DecodeError>) {
    let mut rows = Vec::new();
    let recorder = rows::Recorder::new(octets, &mut rows);
    let stop = decode_traced(message, octets, Limits::Ignored, recorder).err();
    if let Some(error) = &stop {
        // The octets at fault themselves were read, but told of as nothing: they come last.
        let read = rows
            .iter()
            .map(|row| row.offset + row.octets.len())
            .max()
            .unwrap_or(0);
        let rest = octets.get(read..).unwrap_or_default();
        if !rest.is_empty() {
            let row = Row::new(Kind::Unread, error.path.to_string(), read, rest);
            rows.push(row.with_note(error.problem.to_string()));
        }
    }
    (rows, stop)
}
