//! Tests of the recognition of peers, and of the table of departures.

mod recognising;
mod table;
