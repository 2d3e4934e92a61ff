//! Explains a message octet by octet: the field of each octet, its meaning, and where decoding
//! stopped on an error.
//!
//! [`explain`] finds the message by its code and creates the [`Row`]s; [`table`] prints them as an
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
    /// All octets in order; undecoded ones are in the last row.
    pub rows: Vec<Row>,
    /// Where and why decoding stopped, if it did. The offset counts from the message code.
    pub stop: Option<DecodeError>,
    /// Services that define other messages with the same code and another layout.
    pub others: Vec<Id>,
}

impl Explanation {
    /// Adds an offset to the rows, for a message within a datagram.
    #[must_use]
    pub fn shifted(mut self, by: usize) -> Self {
        for row in &mut self.rows {
            row.offset += by;
        }
        self
    }
}

/// Rows of octets decoded by this definition, and where and why decoding stopped.
///
/// Counts outside the limits of the definition are noted, but do not stop it.
pub fn explain_as(message: &Message, octets: &[u8]) -> (Vec<Row>, Option<DecodeError>) {
    let mut rows = Vec::new();
    let recorder = rows::Recorder::new(octets, &mut rows);
    let stop = decode_traced(message, octets, Limits::Ignored, recorder).err();
    if let Some(error) = &stop {
        // The faulty octets were read but not traced: they come last.
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
